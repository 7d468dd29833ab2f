// Ground truth of a panorama by sums over its pixels in double precision: irradiance, brightest region, and prefiltered
// radiance for reflections; three spheres (diffuse, matte silver, mirror), lit by the ground truth and by a descriptor.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>

#include "sim/panorama.hpp"

namespace lightwell::eval {

/// Radiance or irradiance, Rec. 709.
using Color = std::array<double, 3>;

class GroundTruth {
 public:
  explicit GroundTruth(sim::Panorama panorama);

  /// Irradiance, not divided by pi. Within 1e-4 of the sum over single pixels.
  [[nodiscard]] Color irradiance(Vec3d unit_normal) const;
  /// radiance(d, r) of proto/README.md for r >= 0.25; the panorama itself for r = 0.
  [[nodiscard]] Color radiance(Vec3d unit_direction, double perceptual_roughness) const;

  /// Luminance-weighted centroid of the 8-connected pixels around the brightest one with at least half its luminance.
  [[nodiscard]] Vec3d brightest() const { return brightest_; }
  /// Luminance of the brightest pixel divided by the mean over the sphere.
  [[nodiscard]] double peak_to_mean() const { return peak_to_mean_; }

  /// Irradiances at truth_normals().
  [[nodiscard]] std::span<const Color> irradiances() const { return irradiances_; }

 private:
  /// Sums of L d and of L over some neighbouring pixels, weighted by solid angle.
  struct Patch {
    std::array<Vec3d, 3> vector;
    Color sum{};
    Vec3d direction;
    double solid_angle = 0;
  };

  void find_brightest();

  sim::Panorama panorama_;
  std::vector<Patch> patches_;
  std::vector<Color> irradiances_;
  Vec3d brightest_;
  double peak_to_mean_ = 0;
};

/// The 2,048 normals at which proto/README.md defines the error.
[[nodiscard]] const std::vector<Vec3d>& truth_normals();

/// Diffuse, matte silver, mirror.
inline constexpr std::size_t kBalls = 3;

/// Orthographic front views of the balls with albedo 1: the radiance of each pixel on the ball.
using BallPictures = std::array<std::vector<Color>, kBalls>;

[[nodiscard]] BallPictures ball_pictures(const GroundTruth& truth);
/// Lights appear as discs in the mirror. Reflections use the environment map of `descriptor`, if it is whole.
[[nodiscard]] BallPictures ball_pictures(const Descriptor& descriptor);

/// RMS and maximum over colours and channels of the difference, divided by the RMS of the truth; 0 if that is 0.
struct RelativeError {
  double rms = 0, largest = 0;
};
[[nodiscard]] RelativeError relative_error(std::span<const Color> truth, std::span<const Color> estimate);
/// The RMS of each ball.
[[nodiscard]] std::array<double, kBalls> ball_errors(const BallPictures& truth, const BallPictures& estimate);

}  // namespace lightwell::eval
