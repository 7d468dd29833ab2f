// The same lens calibrated many times, each time from other pictures: how wrong it is, and whether it knows.
#pragma once

#include <string>
#include <vector>

#include "calibration/geometry/geometry.hpp"
#include "firmware/calibration/shown_boards.hpp"

namespace lightwell::shown {

/// 1280x960, 190 degrees.
[[nodiscard]] LensParameters lens_of(calibration::LensKind kind);
/// Two such lenses back to back, 30 mm apart, a little askew.
[[nodiscard]] Pair back_to_back();

/// Of a model's directions, RMS over the pixels of the lens's field, rad; infinite where it has none for some pixel.
[[nodiscard]] double direction_error(const LensParameters& truth, const ModelParameters& found);
/// Of T_lens1_lens0: the angle (rad) and the distance (m) that are missed.
struct PairError {
  double turn_rad = 0, shift_m = 0;
};
[[nodiscard]] PairError pair_error(const Pose& truth, const Pose& found);

/// RMS over the angles that were seen, as LensFit::direction_uncertainty_rad is.
[[nodiscard]] double seen_direction_error(const LensParameters& truth, const calibration::LensFit& found);

struct Trials {
  int count = 0, failed = 0;
  std::vector<double> direction_rad;     ///< By trial.
  std::vector<double> focal;             ///< By trial, the larger relative error of fx and fy.
  std::vector<int> within_3_sigma;       ///< By number of the model, in how many trials.
  std::vector<double> normalized;        ///< By number of the model, RMS of its errors in standard deviations.
  double normalized_direction = 0;       ///< Of directions up to the edge that was seen, RMS likewise.
  int shaped = 0;                        ///< In how many trials the board was taken to have a shape of its own.
  std::vector<PairError> pair;           ///< By trial, of a pair.
  std::vector<int> pair_within_3_sigma;  ///< Turn about x, y, z, shift along x, y, z.
};

/// Seeds 1 to `count`.
[[nodiscard]] Trials lens_trials(calibration::LensKind kind, int count, const Show& show);
[[nodiscard]] Trials pair_trials(int count, const Show& show);

}  // namespace lightwell::shown
