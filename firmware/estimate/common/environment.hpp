// The environment map of a descriptor, from the cells of a rig: the one thing that an estimator needs of maps.
#pragma once

#include <optional>
#include <span>

#include <lightwell/environment.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/environment_filter.hpp"
#include "estimate/common/environment_updates.hpp"

namespace lightwell::estimate {

/// Makes maps at a rate of its own. All memory is taken at construction. One thread at a time.
///
///   // Where the rig is known (some tenths of a second, so not per frame):
///   EnvironmentMapper mapper(cell_directions, cell_solid_angles, config.panorama.environment_edge,
///                            {.rate_hz = config.panorama.environment_rate});
///   // In every frame, also where none is due: what `out` held goes back to the mapper (do not reset it before).
///   if (mapper.due(out.time.mid_exposure)) {
///     sums_without_lights = sums;   // then take the lights' pixels out of their cells
///   }
///   mapper.update(sums_without_lights, scale.factor, out.time.mid_exposure, out.environment);
class EnvironmentMapper {
 public:
  /// As EnvironmentFilter and EnvironmentUpdates.
  EnvironmentMapper(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge,
                    EnvironmentUpdateOptions options = {})
      : filter_(direction, solid_angle, edge), updates_({filter_.levels().begin(), filter_.levels().end()}, options) {}

  /// update() will look at the sums. Whoever has another factor than at the last map is due at once.
  [[nodiscard]] bool due(ProbeTime mid_exposure) const { return updates_.due(mid_exposure); }

  /// `sums`: each cell's integral of radiance over its solid angle, lights taken out; cells in the order of the
  /// constructor. `factor`: descriptor radiance per unit of those; where it is another than before, a whole map is
  /// sent, because readers hold the last map beside newer descriptors. Where none is due `out` is none afterwards, and
  /// the sums are not looked at. Allocates nothing as long as `out` is the one of the last call.
  void update(std::span<const CellSum> sums, double factor, ProbeTime mid_exposure,
              std::optional<EnvironmentMap>& out) {
    if (factor != factor_) updates_.restart();
    factor_ = factor;
    if (!updates_.due(mid_exposure)) return updates_.reclaim(out);
    updates_.update(filter_.run(sums), factor, mid_exposure, out);
  }

  [[nodiscard]] const EnvironmentFilter& filter() const { return filter_; }

 private:
  EnvironmentFilter filter_;
  EnvironmentUpdates updates_;
  double factor_ = 0;
};

}  // namespace lightwell::estimate
