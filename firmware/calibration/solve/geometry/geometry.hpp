// Calibrates one lens, or two back to back with boards around them, from observations, without an initial estimate.
#pragma once

#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/geometry/board_observations.hpp"
#include "calibration/solve/geometry/bundle.hpp"

namespace lightwell::calibration {

struct GeometryOptions {
  LensKind kind = LensKind::kannala_brandt;
  /// Estimate the time of lens 1's pictures relative to lens 0's; the rig must move, and Picture::time_s must be set.
  bool time_offset = false;
};

struct LensFit {
  ModelParameters model;
  std::vector<double> covariance;     ///< Of the parameters in the order of parameters_of(), row-major.
  double max_observed_angle_rad = 0;  ///< Largest angle from the axis of an observation.
  double max_model_angle_rad = 0;     ///< Largest angle of the model's domain.
  /// Three standard deviations of the model's directions, RMS over the observed angles, rad.
  double direction_uncertainty_rad = 0;
};

/// Estimated deviation of one board from its description.
struct BoardFit {
  BoardShape shape;          ///< All zero if the observations agree with a plane and the stated spacing.
  double spacing_sigma = 0;  ///< Standard deviation of shape.spacing_change().
  double flatness_m = 0;     ///< flatness() of the shape, m.
};

/// Result for one of the given pictures.
struct PictureFit {
  std::size_t points = 0, outliers = 0;
  bool other_board = false;  ///< Rejected: its tag spacing differs from that in the other pictures.
};

struct GeometryFit {
  std::vector<LensFit> lenses;
  std::vector<BoardFit> boards;
  std::vector<PictureFit> pictures;
  BundleFit bundle;        ///< Of two lenses: `state.lens_from_rig[1]` is T_lens1_lens0, axes _cv.
  BoardObservations used;  ///< The observations of the bundle adjustment: the given ones without the rejected ones.
  std::vector<std::string> notes;  ///< For the user: rejected observations, bent boards.
};

/// invalid_argument for invalid observations (sizes, indices, NaN); failed_precondition for insufficient ones: too few
/// pictures or points, only one tag, all boards parallel, boards or lenses that no capture connects,
/// a lens kind whose parameters are not determined. The message states the remedy.
[[nodiscard]] Result<GeometryFit> calibrate_geometry(const BoardObservations& observations,
                                                     const GeometryOptions& options);

}  // namespace lightwell::calibration
