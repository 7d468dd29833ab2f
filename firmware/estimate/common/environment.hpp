// Interface of environment maps for estimators: from the sums of cells to the map in a descriptor.
#pragma once

#include <optional>
#include <span>

#include <lightwell/environment.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/environment_filter.hpp"
#include "estimate/common/environment_updates.hpp"

namespace lightwell::estimate {

/// Produces prefiltered maps at its own rate. Allocates all memory when constructed. Not thread-safe.
///
///   // Once per rig (takes some tenths of a second):
///   EnvironmentMapper mapper(cell_directions, cell_solid_angles, config.panorama.environment_edge,
///                            {.rate_hz = config.panorama.environment_rate});
///   // In every frame, even where no map is due, because the mapper reuses the memory in `out` (do not reset it
///   before): if (mapper.due(out.time.mid_exposure)) {
///     sums_without_lights = sums;   // then subtract the lights from their cells
///   }
///   mapper.update(sums_without_lights, scale.factor, out.time.mid_exposure, out.environment);
class EnvironmentMapper {
 public:
  /// Parameters as for EnvironmentFilter and EnvironmentUpdates.
  EnvironmentMapper(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge,
                    EnvironmentUpdateOptions options = {})
      : filter_(direction, solid_angle, edge), updates_({filter_.levels().begin(), filter_.levels().end()}, options) {}

  /// Whether update() reads the sums in this frame. With a factor other than that of the last map, it always does.
  [[nodiscard]] bool due(ProbeTime mid_exposure) const { return updates_.due(mid_exposure); }

  /// Sets `out` to a map where one is due, otherwise to nullopt. `sums`: integral of radiance over each cell without
  /// the lights, in the constructor's order of cells; ignored where no map is due. `factor`: descriptor radiance per
  /// unit of radiance in `sums`; where it has changed, a whole map is sent, because readers use the last map with newer
  /// descriptors. Allocates nothing where `out` is that of the previous call.
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
