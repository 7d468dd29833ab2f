// Renderings of the three spheres used to compare light estimates (diffuse, matte silver, mirror), lit by the ground
// truth and by a descriptor.
#pragma once

#include <array>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "tools/lightwell_eval/ground_truth.hpp"

namespace lightwell::eval {

enum class Ball { diffuse, silver, mirror };
inline constexpr std::size_t kBalls = 3;

/// Orthographic front views of the balls with albedo 1: the radiance of each pixel on the ball.
using BallPictures = std::array<std::vector<Color>, kBalls>;

[[nodiscard]] BallPictures ball_pictures(const GroundTruth& truth);
/// Lights appear as discs in the mirror. If `descriptor` has a whole environment map, reflections use it instead of the
/// spherical harmonics.
[[nodiscard]] BallPictures ball_pictures(const Descriptor& descriptor);

/// RMS over pixels and channels of the difference, divided by the RMS of the truth.
[[nodiscard]] std::array<double, kBalls> ball_errors(const BallPictures& truth, const BallPictures& estimate);

}  // namespace lightwell::eval
