// lightwelld and lightwell as processes, and a client in this one.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <lightwell/probe.hpp>

#include "support/child.hpp"

namespace lightwell::test {

/// Builds with a sanitizer are slow: what is right is not younger than this, but it is right.
inline constexpr Duration kAnyAge{60'000'000'000};

struct DaemonOptions {
  std::string camera{};
  double frame_rate = 30;
  std::vector<double> exposure_s{};
  std::string listen = "127.0.0.1:0";
  /// Behind the options that follow from the above.
  std::vector<std::string> more{};
  ChildOptions child{};
};

/// The arguments with which a Daemon starts: 160x120.
[[nodiscard]] std::vector<std::string> daemon_command(const DaemonOptions& options);

/// A running lightwelld.
class Daemon {
 public:
  explicit Daemon(const DaemonOptions& options) : child_(daemon_command(options), options.child) {}

  [[nodiscard]] Child& process() { return child_; }

  /// "grpc://127.0.0.1:41234"; waits until it is said. A daemon that never says it is a failure.
  [[nodiscard]] const std::string& uri();

  /// SIGTERM, and how it ended.
  [[nodiscard]] Ending stop();

 private:
  Child child_;
  std::string uri_;
};

/// The tool.
[[nodiscard]] std::vector<std::string> tool_command(std::vector<std::string> arguments);

/// A client in this process that keeps all that comes, by sequence.
class Observer {
 public:
  explicit Observer(const std::string& uri);

  [[nodiscard]] const Probe& probe() const { return *probe_; }
  [[nodiscard]] Probe& probe() { return *probe_; }

  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] std::map<std::uint64_t, std::vector<std::byte>> bytes() const;
  [[nodiscard]] std::vector<Descriptor> descriptors() const;
  /// Sequences from the first to the last that never came.
  [[nodiscard]] std::vector<std::uint64_t> missing() const;

  /// So many more than now.
  [[nodiscard]] ::testing::AssertionResult gets(std::size_t more) const;
  /// The probe's own counters, asked for about once a second.
  [[nodiscard]] Counters counters() const { return probe_->info().counters; }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, std::vector<std::byte>> bytes_;
  std::vector<Descriptor> descriptors_;
  Result<Probe> probe_;  // last: its thread uses the others
};

}  // namespace lightwell::test
