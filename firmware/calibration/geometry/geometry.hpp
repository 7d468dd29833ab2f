// Calibrates lenses from pictures of boards: from nothing but the sightings to a model, with the covariance of what was
// found. One lens and one board; or two lenses back to back and several boards around them, whose relative poses are
// found in the same fit.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/geometry/bundle.hpp"
#include "calibration/geometry/board_observations.hpp"

namespace lightwell::calibration {

enum class LensKind { kannala_brandt, double_sphere, mei };

struct GeometryOptions {
  LensKind kind = LensKind::kannala_brandt;
  /// Fit how much later than lens 0 lens 1 takes its pictures; the rig has to move and Picture::time_s to be given.
  bool time_offset = false;
};

struct LensFit {
  ModelParameters model;
  std::vector<double> covariance;  ///< Of its numbers in projection.hpp's order, row by row.
  double max_observed_angle_rad = 0;             ///< The largest angle from the axis at which a point was seen.
  double max_model_angle_rad = 0;          ///< Where the model ends.
  /// What three deviations of the model's numbers do to directions, RMS over the angles that were seen, rad.
  double direction_uncertainty_rad = 0;
};

/// How far the sightings of one board are from what its points say.
struct BoardFit {
  BoardShape shape;          ///< All zero where the sightings agree with a plane and the stated spacing.
  double spacing_sigma = 0;  ///< Of its spacing_change().
  double flatness_m = 0;     ///< Height of the fitted surface above the best plane, largest less smallest.
};

/// What became of one of the pictures, as they were given.
struct PictureFit {
  std::size_t points = 0, outliers = 0;
  bool other_board = false;  ///< Its tags are spaced unlike those of the other pictures; it was left out.
};

struct GeometryFit {
  std::vector<LensFit> lenses;
  std::vector<BoardFit> boards;
  std::vector<PictureFit> pictures;
  /// T_lens1_lens0, _cv axes, and its covariance: a turn about lens 1's axes (rad), then a translation (m). Of two
  /// lenses.
  Pose pair;
  std::vector<double> pair_covariance;
  double time_offset_s = 0, time_offset_sigma_s = 0;
  BundleFit bundle;
  BoardObservations used;                  ///< Those of the bundle: what was given less what was left out.
  std::vector<std::string> notes;  ///< Worth saying: sightings that were left out, boards that are bent.
};

/// invalid_argument where sightings are no sightings (sizes, indices, NaN); failed_precondition where they do not tell:
/// too few pictures or points, one tag alone, boards that all face the lens, boards or lenses that nothing joins, a
/// kind of lens whose numbers the pictures do not determine. The message says what to do.
[[nodiscard]] Result<GeometryFit> calibrate_geometry(const BoardObservations& observations, const GeometryOptions& options);

}  // namespace lightwell::calibration
