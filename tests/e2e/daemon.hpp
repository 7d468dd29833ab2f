// lightwelld and the tool lightwell as child processes, and an SDK client in this process.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <lightwell/probe.hpp>

#include "support/child.hpp"

namespace lightwell::test {

/// max_age of clients in tests that are not about age: builds with a sanitizer are slow.
inline constexpr Duration kAnyAge{60'000'000'000};

struct DaemonOptions {
  std::string camera{};
  double frame_rate = 30;
  std::vector<double> exposure_s{};
  std::string listen = "127.0.0.1:0";
  /// Further arguments, appended to those from the above.
  std::vector<std::string> more{};
  ChildOptions child{};
};

/// The command line of a Daemon, with images of 160x120.
[[nodiscard]] std::vector<std::string> daemon_command(const DaemonOptions& options);

/// A running lightwelld.
class Daemon {
 public:
  explicit Daemon(const DaemonOptions& options) : child_(daemon_command(options), options.child) {}

  [[nodiscard]] Child& process() { return child_; }

  /// "grpc://127.0.0.1:41234"; waits until the daemon prints it. If it does not, the test fails.
  [[nodiscard]] const std::string& uri();

  /// Sends SIGTERM and returns the exit status.
  [[nodiscard]] ExitStatus stop();

 private:
  Child child_;
  std::string uri_;
};

/// The command line of the tool lightwell.
[[nodiscard]] std::vector<std::string> tool_command(std::vector<std::string> arguments);

/// An SDK client that keeps all descriptors by sequence number.
class Observer {
 public:
  explicit Observer(const std::string& uri);

  [[nodiscard]] const Probe& probe() const { return *probe_; }
  [[nodiscard]] Probe& probe() { return *probe_; }

  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] std::map<std::uint64_t, std::vector<std::byte>> bytes() const;
  [[nodiscard]] std::vector<Descriptor> descriptors() const;
  /// Sequence numbers missing between the first and the last received descriptor.
  [[nodiscard]] std::vector<std::uint64_t> missing() const;

  /// Waits for `more` further descriptors.
  [[nodiscard]] ::testing::AssertionResult gets(std::size_t more) const;
  /// The probe's counters, which the SDK requests about once a second.
  [[nodiscard]] Counters counters() const { return probe_->info().counters; }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, std::vector<std::byte>> bytes_;
  std::vector<Descriptor> descriptors_;
  Result<Probe> probe_;  // last: its thread uses the others
};

}  // namespace lightwell::test
