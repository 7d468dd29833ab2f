// Where links put what they receive, and where answers come from.
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
#include "core/environment_keeper.hpp"
#include "core/history.hpp"
#include "core/store.hpp"

namespace lightwell::core {

/// The host's clock at the middle of a descriptor's exposure, as its link knows it; nothing where the descriptor must
/// not become the newest (ArrivalGate).
using HostTimeOf = std::function<std::optional<MappedTime>(const CaptureTime&)>;

/// Between one link's reader thread, which writes, and any number of threads that ask.
class Intake {
 public:
  explicit Intake(const ProbeOptions& options);

  // The reader thread's side.

  /// Who the probe is and how its clock stands; the first one lets connect() return.
  void describe(const ProbeInfo& info);
  /// Bytes of one descriptor. Undecodable and untimely ones are counted, and the last good one stays; so are those that
  /// were here before, by number and time of the probe: somebody sent them again.
  void take(std::span<const std::byte> bytes, HostTime received, const HostTimeOf& host_time_of);
  /// A message of so many bytes, dropped unread.
  void refuse_oversized(std::size_t bytes);
  /// Of the link's own frames, since its start: lost, and refused.
  void note_link(std::uint64_t lost, std::uint64_t refused);
  /// Another message of the link that was not what it should be; counted with the undecodable.
  void refuse(const std::string& why);
  void set_state(LinkState state);
  void report_error(const std::string& error);
  /// Numbers and times may begin anew: the link was made anew, or the probe started again. set_state() says so, too,
  /// where the link comes back.
  void begin_anew() { newest_.reset(); }

  // Any thread's side.

  /// Without a lock.
  [[nodiscard]] Lighting latest(HostTime now) const;
  [[nodiscard]] Lighting at(HostTime time) const;

  /// False where describe() was not called in time.
  [[nodiscard]] Status wait_until_described(Duration timeout) const;
  /// As Probe::wait_for_next(), without the lighting.
  [[nodiscard]] Status wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const;
  [[nodiscard]] ProbeInfo info() const;
  [[nodiscard]] LinkStats stats() const;

 private:
  /// What tells a descriptor from those before it.
  struct Identity {
    std::uint32_t probe_id;
    std::uint64_t sequence;
    ProbeTime mid_exposure;
  };

  [[nodiscard]] bool seen_before(const Descriptor& descriptor) const;
  void count(const Descriptor& descriptor, std::size_t bytes, bool map_understood);

  const std::size_t capacity_;
  const Duration max_age_;
  const Duration extrapolation_;
  const std::function<void(const Arrival&)> on_descriptor_;

  EnvironmentKeeper environments_;                      // the reader thread's own
  std::shared_ptr<const History> history_;              // the reader thread's own copy
  std::optional<Identity> newest_;                      // the reader thread's own
  std::shared_ptr<const UncertainPose> T_world_probe_;  // the reader thread's own
  ReconstructAhead reconstruct_ahead_;                  // the reader thread's own
  LatestStore<History> store_;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  ProbeInfo info_;
  LinkStats stats_;
  bool described_ = false;
  bool was_connected_ = false;
  std::optional<std::uint64_t> newest_sequence_;
};

}  // namespace lightwell::core
