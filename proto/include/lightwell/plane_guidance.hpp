// Guidance of a capture: from how many of the directions that count a plane was seen, and where to move next. Firmware
// and SDK compute it from the coverage by the same functions.
//
// A user sees the hemisphere as a disc, by stereographic() of hemisphere_grid.hpp: seen directions green, that of the
// newest frame that contributed red (Jachnik et al. 2012, section 4.3, has the present one).
#pragma once

#include <numbers>
#include <optional>

#include <lightwell/captured_plane.hpp>

namespace lightwell {

struct PlaneGuidanceOptions {
  /// Directions closer to the plane do not count: texels are too foreshortened there. 0 to pi/2.
  double min_elevation_rad = 10 * std::numbers::pi / 180;
  /// Enough is seen where `seen` is at least this ...
  double min_seen = 0.9;
  /// ... and `gap_rad` at most this.
  double max_gap_rad = 15 * std::numbers::pi / 180;
};

/// Whether a capture can be ended.
enum class CaptureProgress : std::uint8_t { keep_moving, enough };

struct PlaneGuidance {
  /// Share of the solid angle of the directions that count that was seen, 0 to 1.
  double seen = 0;
  CaptureProgress progress = CaptureProgress::keep_moving;
  /// Centre of the largest gap: the unit vector towards the viewer, in the plane's frame, of the unseen direction that
  /// counts and is farthest from any seen one. The normal where nothing was seen; none where all was.
  std::optional<Vec3d> next;
  /// Its angle from the nearest seen direction; pi where nothing was seen, 0 where all was.
  double gap_rad = 0;
};

/// Nearest seen directions are found along the grid's edges: in arrangements where the region nearest to one seen
/// direction is narrower than the grid, gap_rad is too large by up to one spacing of the grid. Takes about 1 ms at 60
/// levels, 3 ms at 120. `coverage.seen` must have an element for each node; otherwise nothing counts as seen.
[[nodiscard]] PlaneGuidance plane_guidance(const PlaneCoverage& coverage, const PlaneGuidanceOptions& options = {});

/// Radius on the unit disc of the circle of directions that count: tan((pi/2 - min_elevation_rad) / 2).
[[nodiscard]] double guidance_disc_radius(const PlaneGuidanceOptions& options = {});

/// Unit vector from the middle of the plane to the probe, in the plane's frame, at info.mid_exposure: the viewing
/// direction of the newest frame that contributed, which is not the present one while frames contribute nothing. None
/// if the pose is not known or the probe is not in front of the plane.
[[nodiscard]] std::optional<Vec3d> probe_direction(const PlaneInfo& info);

}  // namespace lightwell
