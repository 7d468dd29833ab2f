// Receives the messages of a connection, and serves queries of any thread.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include <lightwell/probe.hpp>

#include "core/clock_map.hpp"
#include "core/history.hpp"
#include "core/plane_state.hpp"
#include "core/store.hpp"

namespace lightwell::core {

/// Maps mid-exposure of a descriptor to the host's clock; no value if the descriptor must not become the newest
/// (ReplayProtection).
using HostTimeOf = std::function<std::optional<MappedTime>(const CaptureTime&)>;

/// Whether a message of a captured plane may be taken (PlaneReplayProtection); other_capture: after all of the former
/// captures are forgotten.
using PlaneVerdictOf = std::function<PlaneReplayProtection::Verdict(const PlaneInfo&)>;

/// Also takes the messages of the plane that the probe captures. Shared by one connection's reader thread, which
/// writes, and any number of threads, which query.
class DescriptorReceiver {
 public:
  explicit DescriptorReceiver(const ProbeOptions& options);

  // Called by the reader thread.

  /// Sets the properties and the clock of the probe. The first call lets connect() return.
  void describe(const ProbeInfo& info);
  /// Processes the bytes of one descriptor. An undecodable or untimely descriptor, or a duplicate (by sequence number
  /// and time), is counted and dropped; the last valid one is kept.
  void receive(std::span<const std::byte> bytes, HostTime received, const HostTimeOf& host_time_of);
  /// Processes one message of the plane's stream. An invalid one is counted with the undecodable ones, one that
  /// `verdict_of` refuses with the untimely ones. Without `verdict_of` PlaneReader alone decides. With it, a capture is
  /// collected anew after PlaneReplayProtection::kCaptureTimeout without a current and complete state: a forged message
  /// of the probe's own capture, whose revisions are above the probe's, has no longer effect than that.
  void receive_plane(std::span<const std::byte> bytes, HostTime received, const PlaneVerdictOf& verdict_of = {});
  /// Another stream of the plane begins, which starts with a whole plane. Until that is complete, the former one stays.
  void restart_plane() {
    plane_reader_ = {};
    plane_current_.reset();
  }
  /// Counts a message of that size that was dropped without decoding.
  void refuse_oversized(std::size_t bytes);
  /// Sets the numbers of lost and rejected link frames since the start of the link.
  void set_frame_counters(std::uint64_t lost, std::uint64_t refused);
  /// Counts another invalid message of the link, with the undecodable ones.
  void refuse(const std::string& why);
  void set_state(LinkState state);
  void report_error(const std::string& error);
  /// Sequence numbers and times may start again, after a reconnection (set_state() calls it then) or a restart of the
  /// probe.
  void reset_sequence() { newest_.reset(); }

  // Called by any thread.

  /// Lock-free.
  [[nodiscard]] Lighting latest(HostTime now) const;
  [[nodiscard]] Lighting at(HostTime time) const;
  /// Lock-free.
  [[nodiscard]] PlaneAppearance plane(HostTime now) const { return {planes_.read(), now}; }

  /// unavailable if describe() was not called within `timeout`.
  [[nodiscard]] Status wait_until_described(Duration timeout) const;
  /// As Probe::wait_for_next(), without returning the lighting.
  [[nodiscard]] Status wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const;
  [[nodiscard]] ProbeInfo info() const;
  [[nodiscard]] LinkStats stats() const;

 private:
  /// Identity and order of descriptors.
  struct Identity {
    std::uint32_t probe_id;
    std::uint64_t sequence;
    ProbeTime mid_exposure;
  };

  /// Counts a rejected message.
  void drop(std::uint64_t& counter, const std::string& why);
  [[nodiscard]] bool is_duplicate(const Descriptor& descriptor) const;
  void count(const Descriptor& descriptor, std::size_t bytes, bool map_understood);

  const std::size_t capacity_;
  const Duration max_age_;
  const Duration extrapolation_;
  const std::function<void(const Arrival&)> on_descriptor_;
  const std::function<void(const PlaneArrival&)> on_plane_;

  // Used by the reader thread only.
  EnvironmentAssembler environments_;
  std::shared_ptr<const History> history_;
  std::optional<Identity> newest_;
  std::shared_ptr<const UncertainPose> T_world_probe_;
  ReconstructAhead reconstruct_ahead_;
  LatestStore<History> store_;
  PlaneReader plane_reader_;
  /// When plane_reader_ last held the update of the message that it took, complete; at first: when it took one.
  std::optional<HostTime> plane_current_;
  LatestStore<PlaneState> planes_;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  ProbeInfo info_;
  LinkStats stats_;
  bool described_ = false;
  bool was_connected_ = false;
  std::optional<std::uint64_t> newest_sequence_;
};

}  // namespace lightwell::core
