// Initial estimates for the bundle adjustment.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/geometry/board_observations.hpp"
#include "calibration/solve/geometry/bundle.hpp"

namespace lightwell::calibration {

/// Initial estimate of one lens, with an independent pose for each board in each picture.
struct LensInitialization {
  KannalaBrandtParameters lens;
  double rms_px = 0;
  /// T_lens_board by picture (index into BoardObservations::pictures) and board; empty for pictures of other lenses and
  /// for too few observations.
  std::vector<std::vector<std::optional<Pose>>> board_poses;
  double tilt_rad = 0;  ///< Largest angle between the normals of two boards in the lens frame.
};

/// Starts from equidistant lenses with several fields of view, refines each, and returns the one with the smallest
/// error.
[[nodiscard]] Result<LensInitialization> initialize_lens(const BoardObservations& observations, int lens);

/// Chains the poses of the individual lenses: rig poses, and relative poses of boards and lenses. failed_precondition
/// names a capture, board or lens that is not connected to the others.
[[nodiscard]] Result<BundleState> initialize_bundle(const BoardObservations& observations,
                                                    const std::vector<LensInitialization>& lenses);

/// Parameters of `Camera` that best approximate `lens` at angles up to `max_model_angle_rad`. All zero if the model
/// cannot represent such angles.
template <template <class> class Camera>
[[nodiscard]] typename Camera<double>::Parameters equivalent_model(const KannalaBrandtParameters& lens,
                                                                   double max_model_angle_rad);

}  // namespace lightwell::calibration
