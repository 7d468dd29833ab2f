// Queue of all descriptors of a probe, from the SDK's reader thread to the tool's main thread.
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

/// probe_options() with the credentials folder of a paired probe; empty: looked up.
[[nodiscard]] Result<ProbeOptions> options_with(const std::string& credentials);

/// Connection to one probe. No descriptor is dropped here: a slow tool blocks the reader thread. A recording then
/// waits; a probe drops descriptors, which is visible as gaps in the sequence.
class Feed {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Feed>> open(const std::string& uri, const std::string& credentials);
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;
  ~Feed();

  [[nodiscard]] const Probe& probe() const { return *probe_; }

  /// The next descriptor; no value at `deadline`, at the end of a recording, or after SIGINT or SIGTERM.
  [[nodiscard]] std::optional<ReceivedDescriptor> next(HostTime deadline);

  /// The end of a recording is reached and next() has returned all descriptors.
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

/// After this call SIGINT and SIGTERM end loops instead of the process, so that a summary is printed.
void stop_on_signals();
[[nodiscard]] bool stop_requested();

}  // namespace lightwell::tool
