// A probe's status and its commands: the interfaces that links and dashboards use.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <lightwell/config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
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

/// Commands that links receive from clients. Called from any of a link's threads.
class Commands {
 public:
  virtual ~Commands() = default;

  [[nodiscard]] virtual StatusSnapshot status() const = 0;
  [[nodiscard]] virtual EstimatorConfig estimator() const = 0;
  /// The active estimator, which determines the available options.
  [[nodiscard]] virtual EstimatorKind estimator_kind() const = 0;
  /// Changes the fields of `update` atomically: concurrent updates do not overwrite each other's fields. Takes effect
  /// with the next capture. invalid_argument changes nothing.
  [[nodiscard]] virtual Status update_estimator(const EstimatorUpdate& update) = 0;
  /// Scales radiance so that the irradiance at `normal` (unit, probe frame) is `lux`; returns the factor.
  [[nodiscard]] virtual Result<double> report_lux(double lux, Vec3d normal) = 0;
};

}  // namespace lightwell
