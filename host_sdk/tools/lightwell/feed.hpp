// Every descriptor of a probe, brought from the SDK's reader thread to the tool's main thread.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/probe.hpp>

namespace lightwell::tool {

/// A copy of an Arrival.
struct ReceivedDescriptor {
  std::vector<std::byte> bytes;
  Descriptor descriptor;
  HostTime mid_exposure, received, stored;
};

/// probe_options(), and the folder of a paired probe where one is named.
[[nodiscard]] Result<ProbeOptions> options_with(const std::string& credentials);

/// Follows one probe. Nothing is lost here: a tool that is slow holds the reader up, a recording
/// waits, and a probe drops and shows it in its sequence.
class Feed {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Feed>> open(const std::string& uri, const std::string& credentials);
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;
  ~Feed();

  [[nodiscard]] const Probe& probe() const { return *probe_; }

  /// The next, or nothing at `deadline`, at the end of a recording, or after SIGINT or SIGTERM.
  [[nodiscard]] std::optional<ReceivedDescriptor> next(HostTime deadline);

  /// A recording's end was reached and everything was handed out.
  [[nodiscard]] bool over() const;

 private:
  Feed() = default;
  void put(const Arrival& arrival);

  static constexpr std::size_t kMaxWaiting = 256;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ReceivedDescriptor> waiting_;
  bool closed_ = false;
  std::optional<Probe> probe_;
};

/// From here on SIGINT and SIGTERM end loops instead of the process, so that a summary is written.
void stop_on_signals();
[[nodiscard]] bool stop_requested();

}  // namespace lightwell::tool
