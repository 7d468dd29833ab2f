// Repeated calibrations of one lens from different simulated pictures: errors, and consistency of the covariance.
#pragma once

#include <string>
#include <vector>

#include "calibration/solve/geometry/geometry.hpp"
#include "firmware/calibration/shown_boards.hpp"

namespace lightwell::shown {

/// A lens of 1280x960 pixels and 190 degrees.
[[nodiscard]] LensParameters lens_of(calibration::LensKind kind);
/// Two such lenses back to back, 30 mm apart, slightly misaligned.
[[nodiscard]] Pair back_to_back();

/// RMS error of a model's directions over the pixels in the field of view, rad; infinite if a pixel has no direction.
[[nodiscard]] double direction_error(const LensParameters& truth, const ModelParameters& found);
/// Error of T_lens1_lens0: angle (rad) and distance (m).
struct PairError {
  double turn_rad = 0, shift_m = 0;
};
[[nodiscard]] PairError pair_error(const Pose& truth, const Pose& found);

/// RMS error of directions over the observed angles, like LensFit::direction_uncertainty_rad.
[[nodiscard]] double observed_direction_error(const LensParameters& truth, const calibration::LensFit& found);

struct Trials {
  int count = 0, failed = 0;
  std::vector<double> direction_rad;     ///< By trial.
  std::vector<double> focal;             ///< By trial, the larger relative error of fx and fy.
  std::vector<int> within_3_sigma;       ///< By model parameter: number of trials.
  std::vector<double> normalized;        ///< By model parameter: RMS of its errors in standard deviations.
  double normalized_direction = 0;       ///< The same for directions up to the largest observed angle.
  int shaped = 0;                        ///< Number of trials in which a board shape was estimated.
  std::vector<PairError> pair;           ///< By trial, for a pair.
  std::vector<int> pair_within_3_sigma;  ///< Rotation about x, y, z, translation along x, y, z: number of trials.
};

/// Runs `count` trials, with seeds 1 to `count`.
[[nodiscard]] Trials lens_trials(calibration::LensKind kind, int count, const Show& show);
[[nodiscard]] Trials pair_trials(int count, const Show& show);

}  // namespace lightwell::shown
