// Boards shown to lenses that are known: what a detector would have seen, with the noise that it has.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/geometry/board_observations.hpp"

namespace lightwell::shown {

/// 6 x 6 tags of 30 mm with gaps of 9 mm, 144 corners.
[[nodiscard]] calibration::Board board(double spacing = 0.3);

/// How the noise of corners is distributed; its RMS about noise_px each time.
enum class Noise {
  alike,         ///< Gaussian, independent.
  contaminated,  ///< One corner in ten has three times as much as the rest.
  by_picture,    ///< Every third picture has three times as much as the rest.
  within_tag     ///< Half of the variance is the same for all corners of a tag.
};

enum class Bend { none, cylinder, sphere };

struct Show {
  int pictures = 40;
  double noise_px = 0.2;  ///< Of each coordinate, Gaussian.
  double tilt_rad = 0.7;  ///< Boards are turned away from the lens by up to this.
  double nearest_m = 0.12, farthest_m = 0.4;
  double wrong_share = 0;  ///< Of corners that are anywhere.
  Noise noise = Noise::alike;
  Bend bend = Bend::none;          ///< Of the board that is shown; the sightings' one is flat.
  double bend_m = 0.002;           ///< Height of its middle above its ends.
  double spacing = 0.3;            ///< Of the board that is shown; the sightings' one has 0.3.
  int other_spacing_pictures = 0;  ///< The first ones show a board whose spacing is 0.4.
  std::uint32_t seed = 1;
};

/// One board shown to one lens, all over its field.
[[nodiscard]] calibration::BoardObservations one_lens(const LensParameters& lens, const Show& show);

/// Where lens 1 of a pair is and when it takes its pictures.
struct Pair {
  LensParameters lens;
  Pose lens1_from_lens0;  ///< T_lens1_lens0, _cv.
  double later_s = 0;
};

/// Four boards around a pair that is turned and moved among them, 20 captures a second.
[[nodiscard]] calibration::BoardObservations pair_of_lenses(const Pair& pair, const Show& show);

}  // namespace lightwell::shown
