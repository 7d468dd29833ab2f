// Bundle adjustment (Triggs et al. 2000) of lenses, boards and rig poses to all observations, with Ceres.
//   pixel = project(lens, T_lens_rig T_rig_world T_world_board point)
// The rig frame is lens 0's frame, axes _cv; the world frame is board 0's.
#pragma once

#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/geometry/board_observations.hpp"

namespace lightwell::calibration {

enum class LensKind { kannala_brandt, double_sphere, mei };

/// The parameters of the bundle adjustment.
struct BundleState {
  std::vector<ModelParameters> lenses;
  std::vector<Pose> lens_from_rig;     ///< T_lens_rig by lens; the identity for lens 0.
  std::vector<Pose> rig_from_world;    ///< T_rig_world by capture.
  std::vector<Pose> world_from_board;  ///< T_world_board by board; the identity for board 0.
  /// Time of lens 1's pictures less that of lens 0's, s.
  double time_offset_s = 0;
  /// By board; empty: all boards are exactly as described.
  std::vector<BoardShape> shapes;
};

struct BundleOptions {
  bool time_offset = false;  ///< Estimate the time offset; the rig must move.
  bool shapes = false;       ///< Estimate the shapes of the boards.
  /// Scale of the Huber loss, pixels.
  double robust_px = 1;
  int max_iterations = 200;
};

/// Reprojection error of one observation after the fit.
struct Residual {
  int picture = 0;
  int observation = 0;
  double x_px = 0, y_px = 0;  ///< Predicted less observed.
};

/// A value and its standard deviation.
struct Estimate {
  double value = 0, sigma = 0;
};

/// Result of the bundle adjustment. Matrices are row-major, covariances clustered by capture (covariance.hpp).
struct BundleFit {
  BundleState state;
  std::vector<Residual> residuals;
  double rms_px = 0;     ///< RMS of the residual's length.
  double sigma_px = 0;   ///< Standard deviation of one coordinate, from the residuals' RMS.
  double spread_px = 0;  ///< The same from the median absolute residual (times 1.48), robust against outliers.
  /// By lens, of the model's parameters in the order of parameters_of().
  std::vector<std::vector<double>> lens_covariance;
  /// Covariance of T_lens1_rig, 6 x 6: rotation about lens 1's axes (rad), then translation (m). Empty for one lens.
  std::vector<double> pair_covariance;
  double time_offset_sigma_s = 0;
  /// By board: its shape, with covariance below. If not estimated: one Gauss-Newton step of all parameters at the end.
  std::vector<BoardShape> shapes;
  std::vector<std::vector<double>> shape_covariance;
  /// By capture: relative tag spacing compared with that in the other captures; sigma 0 without observations.
  std::vector<Estimate> capture_spacing;
};

/// Minimises the reprojection errors from an initial estimate. failed_precondition if the solver does not converge or
/// the observations do not determine a parameter (the message states which).
[[nodiscard]] Result<BundleFit> fit_bundle(const BoardObservations& observations, const BundleState& start,
                                           const BundleOptions& options);

}  // namespace lightwell::calibration
