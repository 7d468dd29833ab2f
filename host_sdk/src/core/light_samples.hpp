// Directions by which the light of a plane is sampled, in the plane's frame (+Z its normal).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/hemisphere_grid.hpp>

namespace lightwell::core {

/// A direction or a position that stands for a part of a light.
struct LightSample {
  Vec3d towards;      ///< Unit direction, z > 0; or a position, m, of a near light.
  double weight = 0;  ///< Share of the light's irradiance of the plane.
};

/// Point i of `count` in the unit disc, each of the same area: a spiral by the golden angle (Vogel 1979, "A better way
/// to construct the sunflower head").
[[nodiscard]] DiscPoint disc_point(int i, int count);

/// Directions over the cap of angular radius `radius_rad` around the unit vector `axis`: equal solid angles, weighted
/// by the cosine, without those below the horizon. About `count`, of which the weights add up to 1; none if the cap is
/// below the horizon. One for radius 0.
void sample_cap(Vec3d axis, double radius_rad, int count, std::vector<LightSample>& samples);

/// Positions over the disc of `radius_m` around `centre` that faces `target`, m, without those below the horizon. At
/// most `count`, of equal weights that add up to 1. One for radius 0.
void sample_near_light(Vec3d centre, double radius_m, Vec3d target, int count, std::vector<LightSample>& samples);

/// A direction of the hemisphere and the irradiance that the radiance around it causes.
struct HemisphereSample {
  Vec3d towards;
  Irradiance irradiance;
};

/// The hemisphere in cells of equal projected solid angle around fixed directions.
class HemisphereSampler {
 public:
  explicit HemisphereSampler(int directions);

  /// Integrates radiance times cosine over each cell, by several directions in it. Allocates nothing.
  [[nodiscard]] std::span<const HemisphereSample> sample(const std::function<Radiance(Vec3d)>& radiance);

 private:
  /// Directions in which a cell's radiance is evaluated, on average.
  static constexpr int kPerCell = 8;

  struct Probe {
    Vec3d towards;
    std::uint32_t cell = 0;
  };
  std::vector<Probe> probes_;
  std::vector<HemisphereSample> samples_;
};

}  // namespace lightwell::core
