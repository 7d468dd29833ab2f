// ProbeInfo from a status and the clock map.
#pragma once

#include <lightwell/probe.hpp>
#include <lightwell/status.hpp>

#include "core/clock_map.hpp"

namespace lightwell::core {

[[nodiscard]] inline ProbeInfo probe_info(const StatusSnapshot& status, const ClockMap& clock, HostTime now) {
  return {.name = status.probe_name,
          .id = status.probe_id,
          .calibration_id = status.calibration_id,
          .version = status.version,
          .camera = status.camera,
          .clock_offset = clock.offset(now),
          .clock_uncertainty = clock.uncertainty(now),
          .clock_drift_ppm = 1e6 * clock.drift(),
          .counters = status.counters,
          .T_world_probe = status.T_world_probe};
}

}  // namespace lightwell::core
