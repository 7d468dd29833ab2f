// What is true of a panorama, by plain sums over its pixels in double: its irradiance, its brightest region, and the
// light that reflections see.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>

#include "sim/panorama.hpp"

namespace lightwell::eval {

/// Radiance or irradiance, Rec. 709.
using Color = std::array<double, 3>;

/// Unit vectors spread evenly: Gonzalez 2010, half a step left at either pole.
[[nodiscard]] std::vector<Vec3d> fibonacci_normals(int count);

class GroundTruth {
 public:
  GroundTruth(std::string name, const sim::Panorama& panorama);

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Not divided by pi. Within 1e-4 of the sum over single pixels.
  [[nodiscard]] Color irradiance(Vec3d unit_normal) const;
  /// proto/README.md's radiance(d, r) for r >= 0.25; at 0 the panorama itself.
  [[nodiscard]] Color radiance(Vec3d unit_direction, double perceptual_roughness) const;

  /// Of the 8-connected pixels at or above half the brightest one's luminance: the luminance-weighted centroid.
  [[nodiscard]] Vec3d brightest() const { return brightest_; }
  /// The brightest pixel's luminance by the mean over the sphere.
  [[nodiscard]] double peak_to_mean() const { return peak_to_mean_; }

  /// At the 2,048 normals of proto/README.md's error.
  [[nodiscard]] std::span<const Color> irradiances() const { return irradiances_; }

 private:
  /// Light of some neighbouring pixels: sums of L d and of L, by solid angle.
  struct Patch {
    std::array<Vec3d, 3> vector;
    Color sum{};
    Vec3d direction;
    double solid_angle = 0;
  };

  void find_brightest();

  std::string name_;
  sim::Panorama panorama_;
  std::vector<Patch> patches_;
  std::vector<Color> irradiances_;
  Vec3d brightest_;
  double peak_to_mean_ = 0;
};

/// The normals of Truth::irradiances().
[[nodiscard]] const std::vector<Vec3d>& truth_normals();

}  // namespace lightwell::eval
