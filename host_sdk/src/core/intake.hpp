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

#include "core/environment_keeper.hpp"
#include "core/history.hpp"
#include "core/store.hpp"

namespace lightwell::core {

/// The host's clock at the middle of a descriptor's exposure, as its link knows it.
using HostTimeOf = std::function<HostTime(const CaptureTime&)>;

/// Between one link's reader thread, which writes, and any number of threads that ask.
class Intake {
 public:
  explicit Intake(const ProbeOptions& options);

  // The reader thread's side.

  /// Who the probe is and how its clock stands; the first one lets connect() return.
  void describe(const ProbeInfo& info);
  /// Bytes of one descriptor. Undecodable ones are counted, and the last good one stays.
  void take(std::span<const std::byte> bytes, HostTime received, const HostTimeOf& host_time_of);
  /// A message of so many bytes, dropped unread.
  void refuse_oversized(std::size_t bytes);
  void set_state(LinkState state);
  void report_error(const std::string& error);

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
  void count(const Descriptor& descriptor, std::size_t bytes, bool map_understood);

  const std::size_t capacity_;
  const Duration max_age_;
  const std::function<void(const Arrival&)> on_descriptor_;

  EnvironmentKeeper environments_;          // the reader thread's own
  std::shared_ptr<const History> history_;  // the reader thread's own copy
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
