// First guesses, good enough for a bundle to start from.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/geometry/bundle.hpp"
#include "calibration/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// A lens by itself, each board of each picture with a pose of its own.
struct LensInitialization {
  KannalaBrandtParameters lens;
  double rms_px = 0;
  /// T_lens_board by picture of BoardObservations::pictures and board; nothing of other lenses and where too little was seen.
  std::vector<std::vector<std::optional<Pose>>> board_poses;
  double tilt_rad = 0;  ///< The largest angle between two boards' normals, seen from the lens.
};

/// Tries equidistant lenses of several fields of view and keeps the one that a fit makes the best of.
[[nodiscard]] Result<LensInitialization> initialize_lens(const BoardObservations& observations, int lens);

/// Joins what the lenses saw by themselves: where the rig stood, how boards and lenses stand to each other.
/// failed_precondition names what nothing joins.
[[nodiscard]] Result<BundleState> initialize_bundle(const BoardObservations& observations, const std::vector<LensInitialization>& lenses);

/// Another model that maps the angles up to `largest_rad` as `lens` does, as nearly as it can. All zero where none
/// reaches so far.
template <class Model>
[[nodiscard]] typename Model::Parameters equivalent_model(const KannalaBrandtParameters& lens, double max_model_angle_rad);

}  // namespace lightwell::calibration
