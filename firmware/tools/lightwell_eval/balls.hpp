// The three balls by which light estimation is compared: diffuse, matte silver, mirror; lit by the truth and by a
// descriptor.
#pragma once

#include <array>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "tools/lightwell_eval/ground_truth.hpp"

namespace lightwell::eval {

enum class Ball { diffuse, silver, mirror };
inline constexpr std::size_t kBalls = 3;

/// Pictures of the balls from the front, from infinitely far, albedo 1: radiance of each pixel on the ball.
using BallPictures = std::array<std::vector<Color>, kBalls>;

[[nodiscard]] BallPictures ball_pictures(const GroundTruth& truth);
/// Lights are discs in the mirror. `descriptor` may carry a whole environment map, which then stands for the harmonics
/// in reflections.
[[nodiscard]] BallPictures ball_pictures(const Descriptor& descriptor);

/// RMS over pixels and channels of the difference, by the RMS of the truth.
[[nodiscard]] std::array<double, kBalls> ball_errors(const BallPictures& truth, const BallPictures& answer);

}  // namespace lightwell::eval
