// Simulated observations of boards by known lenses, with detector noise.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/solve/geometry/board_observations.hpp"

namespace lightwell::shown {

/// A board of 6 x 6 tags of 30 mm with gaps of 9 mm, 144 corners.
[[nodiscard]] calibration::Board board(double spacing = 0.3);

/// Distribution of the corner noise; the RMS is about noise_px in all cases.
enum class Noise {
  alike,         ///< Gaussian, independent.
  contaminated,  ///< One corner in ten has three times the noise of the others.
  by_picture,    ///< Every third picture has three times the noise of the others.
  within_tag     ///< Half of the variance is common to all corners of a tag.
};

enum class Bend { none, cylinder, sphere };

struct Show {
  int pictures = 40;
  double noise_px = 0.2;  ///< Standard deviation of each coordinate.
  double tilt_rad = 0.7;  ///< Largest tilt of the boards.
  double nearest_m = 0.12, farthest_m = 0.4;
  double wrong_share = 0;  ///< Fraction of outliers, at random positions.
  Noise noise = Noise::alike;
  Bend bend = Bend::none;          ///< Of the simulated board; its description is flat.
  double bend_m = 0.002;           ///< Height of its centre above its ends.
  double spacing = 0.3;            ///< Of the simulated board; its description has 0.3.
  int other_spacing_pictures = 0;  ///< Number of pictures, at the beginning, of a board with a spacing of 0.4.
  std::uint32_t seed = 1;
};

/// Observations of one board by one lens, over its whole field of view.
[[nodiscard]] calibration::BoardObservations one_lens(const LensParameters& lens, const Show& show);

/// Pose and time offset of lens 1 of a pair.
struct Pair {
  LensParameters lens;
  Pose lens1_from_lens0;  ///< T_lens1_lens0, axes _cv.
  double later_s = 0;
};

/// Observations of four boards around a moving pair, 20 captures per second.
[[nodiscard]] calibration::BoardObservations pair_of_lenses(const Pair& pair, const Show& show);

}  // namespace lightwell::shown
