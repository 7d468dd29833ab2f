// A probe's status: what links and dashboards report.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// Counters since the start of the daemon. Meanings: proto/lightwell/v1/probe_service.proto.
struct Counters {
  std::uint64_t frames = 0;
  std::uint64_t captures_dropped = 0;
  std::uint64_t brackets_incomplete = 0;
  std::uint64_t estimates = 0;
  std::uint64_t estimates_failed = 0;
  std::uint64_t descriptors_coalesced = 0;
  std::uint32_t clients = 0;
  std::uint64_t frames_recorded = 0;
  std::uint64_t recording_faults = 0;
  std::uint64_t frames_lost = 0;
  std::uint64_t setting_moves = 0;
  std::uint64_t estimates_late = 0;
  std::uint64_t estimates_late_at_fast = 0;
  std::uint64_t messages_refused = 0;
  std::uint64_t authentication_failures = 0;
  std::uint64_t client_list_faults = 0;

  friend bool operator==(const Counters&, const Counters&) = default;
};

struct StatusSnapshot {
  std::string probe_name;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  std::string version;
  std::string camera;
  Counters counters;
  std::optional<UncertainPose> T_world_probe;  ///< Mounting of the probe in its room, if configured.

  friend bool operator==(const StatusSnapshot&, const StatusSnapshot&) = default;
};

}  // namespace lightwell
