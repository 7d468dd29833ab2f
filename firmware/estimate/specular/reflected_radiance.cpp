#include "estimate/specular/reflected_radiance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>

#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

/// Of a mean over texels: rounding, interpolation.
constexpr float kMinSigma = 0.0004F;
/// Levels of the hemisphere that are used for Fresnel's rise: elevations above this. Below it the separation has larger
/// errors, and above it the gloss' albedo already grows fourfold.
constexpr double kMinElevation_rad = 20 * std::numbers::pi / 180;
/// Relative standard deviations of the darker quarter of the environment: between neighbouring levels, and of its
/// change from the horizon to the zenith.
constexpr double kDarkScatter = 0.15, kDarkSlope = 1;
/// Sine of the elevation in the middle of the levels that are used.
constexpr double kMiddleHeight = 0.7;

}  // namespace

ReflectedRadiance sample(const Lumisphere& lumisphere, const HemisphereGrid& grid) {
  ReflectedRadiance out{grid, std::vector<Radiance>(grid.size()),
                        std::vector<float>(grid.size(), std::numeric_limits<float>::infinity()),
                        std::vector<std::uint8_t>(grid.size())};
  for (std::size_t node = 0; node < grid.size(); ++node) {
    const auto where = lumisphere.grid.interpolate(vec_cast<float>(grid.direction(node)));
    out.value[node] = lumisphere.at(where);
    bool seen = true;
    float scatter = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(where.weight[k] > 0)) continue;
      seen = seen && lumisphere.weight[where.node[k]] > 0;
      scatter += where.weight[k] * lumisphere.sigma[where.node[k]];
      if (lumisphere.clipped[where.node[k]] != 0) out.lower_bound[node] = 1;
    }
    if (seen) out.sigma[node] = std::hypot(kMinSigma, 0.1F * scatter + 5 * scatter * scatter);
  }
  return out;
}

std::optional<DiffuseRange> diffuse_range(const TexelImage& diffuse) {
  DiffuseRange out;
  std::vector<float> values;
  for (int c = 0; c < 3; ++c) {
    values.clear();
    for (const TexelRadiance& t : diffuse)
      if (t.seen()) values.push_back(t.radiance()[c]);
    if (values.size() < 100) return std::nullopt;
    out.dark[c] = static_cast<float>(upper_quantile(values, 0.01));
    out.bright[c] = static_cast<float>(upper_quantile(values, 0.99));
  }
  return out;
}

CommonRadiance common_radiance(const GlossOperator& gloss, const ReflectedRadiance& reflected,
                               const DiffuseRange& diffuse, const WhiteAlbedo& white,
                               const CommonIrradiance& irradiance) {
  const HemisphereGrid& grid = gloss.grid();
  const double bright = static_cast<double>(diffuse.bright.luminance());
  const double expected = std::numbers::pi * bright / white.value, mean = expected / std::numbers::pi;
  if (!(mean > 0)) return {};
  // Unknowns: radiance a of the darker quarter at kMiddleHeight, its change b with the height, c.
  using Row = Eigen::Vector3d;
  Eigen::Matrix<double, 3, 4> normal;
  const auto add = [&normal](const Row& row, double value, double sigma) {
    const double weight = 1 / (sigma * sigma);
    normal.leftCols<3>() += weight * row * row.transpose();
    normal.col(3) += weight * value * row;
  };
  struct Level {
    double albedo, height, quarter;
  };
  std::vector<Level> levels;
  std::vector<float> ring;
  for (int level = 1; level < grid.levels(); ++level) {
    const double elevation = std::numbers::pi / 2 - level * grid.spacing_rad();
    if (elevation < kMinElevation_rad) break;
    ring.clear();
    const std::size_t first = HemisphereGrid::first_of(level);
    const auto nodes = static_cast<std::size_t>(HemisphereGrid::nodes_of(level));
    for (std::size_t node = first; node < first + nodes; ++node)
      if (reflected.seen(node) && reflected.lower_bound[node] == 0) ring.push_back(reflected.value[node].luminance());
    if (ring.size() < nodes / 2) continue;
    levels.push_back({static_cast<double>(gloss.albedo()[first]), std::sin(elevation) - kMiddleHeight,
                      static_cast<double>(upper_quantile(ring, 0.25))});
  }
  double scale = mean;  // Of a, on which the standard deviations depend.
  Eigen::Vector3d solution = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int round = 0; round < 4; ++round) {
    normal.setZero();
    for (const Level& level : levels)
      add({level.albedo, level.albedo * level.height, -1}, level.quarter,
          kDarkScatter * level.albedo * scale + static_cast<double>(kMinSigma));
    add({0, 1, 0}, 0, kDarkSlope * mean);
    add({1, 0, 0}, 0, 100 * mean);
    add({0, 0, irradiance.slope + std::numbers::pi / white.value},
        expected - static_cast<double>(irradiance.without_common.luminance()),
        std::hypot(expected * white.sigma / white.value, irradiance.sigma));
    covariance = normal.leftCols<3>().inverse();
    solution = covariance * normal.col(3);
    scale = std::clamp(solution[0], 0.1 * mean, 10 * mean);
  }
  CommonRadiance out;
  const double dark = static_cast<double>(diffuse.dark.luminance()), least_albedo = white.value - white.sigma;
  // More would light the plane more than its texture shows.
  const double most =
      (std::numbers::pi * bright / least_albedo - static_cast<double>(irradiance.without_common.luminance())) /
      (irradiance.slope + std::numbers::pi / least_albedo);
  const double common = std::clamp(solution[2], 0.0, std::max(0.0, std::min(dark, most)));
  out.sigma = static_cast<float>(std::sqrt(covariance(2, 2)));
  const double total = static_cast<double>(irradiance.without_common.luminance()) + irradiance.slope * common;
  for (int c = 0; c < 3; ++c) {
    const double of_channel = total * static_cast<double>(diffuse.bright[c]) / bright;
    const double value = (of_channel - static_cast<double>(irradiance.without_common[c])) / irradiance.slope;
    out.value[c] = static_cast<float>(std::clamp(value, 0.0, std::max(0.0, static_cast<double>(diffuse.dark[c]))));
  }
  return out;
}

}  // namespace lightwell::specular
