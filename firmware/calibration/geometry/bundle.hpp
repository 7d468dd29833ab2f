// The bundle: lenses, boards and where the rig stood, fitted to all sightings at once (Triggs et al. 2000), by Ceres.
//   pixel = project(lens, T_lens_rig T_rig_world T_world_board point)
// The rig's frame is lens 0's, _cv; the world's is board 0's.
#pragma once

#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/geometry/board_shape.hpp"
#include "calibration/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// What is fitted, before and after.
struct BundleState {
  std::vector<ModelParameters> lenses;
  std::vector<Pose> lens_from_rig;     ///< T_lens_rig; of lens 0 the identity.
  std::vector<Pose> rig_from_world;    ///< By capture.
  std::vector<Pose> world_from_board;  ///< Of board 0 the identity.
  /// How much later than lens 0 lens 1 takes its pictures, s.
  double time_offset_s = 0;
  /// By board; empty: all are as their points say.
  std::vector<BoardShape> shapes;
};

struct BundleOptions {
  bool time_offset = false;  ///< Fit it; the rig has to move.
  bool shapes = false;       ///< Fit the shapes of the boards.
  /// Residuals from here on count less and less (Huber), in pixels.
  double robust_px = 1;
  int max_iterations = 200;
};

/// One sighting's error after the fit.
struct Residual {
  int picture = 0;
  int observation = 0;
  double x_px = 0, y_px = 0;  ///< Predicted less seen.
};

/// A number and its standard deviation.
struct Estimate {
  double value = 0, sigma = 0;
};

/// Square matrices, row by row. Covariances are clustered by capture (covariance.hpp).
struct BundleFit {
  BundleState state;
  std::vector<Residual> residuals;
  double rms_px = 0;     ///< Of both coordinates together.
  double sigma_px = 0;   ///< Of one coordinate, from the residuals' RMS.
  double spread_px = 0;  ///< The same from 1.48 medians: what most points have, whatever the worst do.
  /// By lens, of the model's numbers in projection.hpp's order.
  std::vector<std::vector<double>> lens_covariance;
  /// Of T_lens1_rig: a turn about lens 1's axes (rad), then its translation (m). Empty for one lens.
  std::vector<double> pair_covariance;
  double time_offset_sigma_s = 0;
  /// By board: its shape with its covariance. Where it was not fitted, what the residuals say that it is (one
  /// Gauss-Newton step together with all other parameters).
  std::vector<BoardShape> shapes;
  std::vector<std::vector<double>> shape_covariance;
  /// By capture: how much further apart its tags are than in the others, relative; sigma 0 where nothing was seen.
  std::vector<Estimate> capture_spacing;
};

/// From a good start to the best fit. failed_precondition where the solver does not converge or something cannot be
/// told from the sightings (the message says what).
[[nodiscard]] Result<BundleFit> fit_bundle(const BoardObservations& observations, const BundleState& start,
                                           const BundleOptions& options);

}  // namespace lightwell::calibration
