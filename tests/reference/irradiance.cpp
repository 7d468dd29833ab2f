#include "reference/irradiance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace lightwell::reference {

namespace {

constexpr std::size_t lanes = 4;
constexpr std::size_t block_pixels = 512;  // six arrays of this length stay in a 32 KiB cache

/// A block of pixels: direction, and radiance times solid angle. Unused entries are zero and contribute
/// nothing.
struct Block {
  std::array<double, block_pixels> x{}, y{}, z{}, r{}, g{}, b{};
};

std::vector<Block> blocks_of(const Panorama& p) {
  std::vector<Block> blocks;
  std::size_t used = block_pixels;
  for (int j = 0; j < p.height; ++j) {
    const double solid_angle = pixel_solid_angle(j, p.width, p.height);
    for (int i = 0; i < p.width; ++i) {
      if (used == block_pixels) {
        blocks.emplace_back();
        used = 0;
      }
      Block& block = blocks.back();
      const V3 d = pixel_direction(i, j, p.width, p.height);
      const Rgb radiance = pixel(p, i, j);
      block.x[used] = d.x;
      block.y[used] = d.y;
      block.z[used] = d.z;
      block.r[used] = solid_angle * radiance[0];
      block.g[used] = solid_angle * radiance[1];
      block.b[used] = solid_angle * radiance[2];
      ++used;
    }
  }
  return blocks;
}

using Lanes = std::array<double, lanes>;

/// A few normals that the compiler can process in one vector register without changing the order of
/// any sum.
struct Bundle {
  Lanes x{}, y{}, z{}, r{}, g{}, b{};
};

void add(const Block& block, Bundle& bundle) {
  const Lanes x = bundle.x, y = bundle.y, z = bundle.z;
  Lanes r{}, g{}, b{};
  for (std::size_t i = 0; i < block_pixels; ++i) {
    for (std::size_t k = 0; k < lanes; ++k) {
      const double product = x[k] * block.x[i] + y[k] * block.y[i] + z[k] * block.z[i];
      const double cosine = product > 0 ? product : 0;
      r[k] += cosine * block.r[i];
      g[k] += cosine * block.g[i];
      b[k] += cosine * block.b[i];
    }
  }
  for (std::size_t k = 0; k < lanes; ++k) {
    bundle.r[k] += r[k];
    bundle.g[k] += g[k];
    bundle.b[k] += b[k];
  }
}

double ratio(double squared_error, double squared_truth) {
  if (squared_truth > 0) return std::sqrt(squared_error / squared_truth);
  return squared_error > 0 ? std::numeric_limits<double>::infinity() : 0.0;
}

}  // namespace

Rgb irradiance(const Panorama& p, const V3& n) {
  Rgb sum{};
  for (int j = 0; j < p.height; ++j) {
    const double solid_angle = pixel_solid_angle(j, p.width, p.height);
    for (int i = 0; i < p.width; ++i) {
      const double cosine = std::max(0.0, dot(n, pixel_direction(i, j, p.width, p.height)));
      const Rgb radiance = pixel(p, i, j);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += cosine * radiance[c] * solid_angle;
    }
  }
  return sum;
}

std::vector<Rgb> irradiance_at(const Panorama& p, const std::vector<V3>& normals) {
  std::vector<Bundle> bundles((normals.size() + lanes - 1) / lanes);
  for (std::size_t n = 0; n < normals.size(); ++n) {
    bundles[n / lanes].x[n % lanes] = normals[n].x;
    bundles[n / lanes].y[n % lanes] = normals[n].y;
    bundles[n / lanes].z[n % lanes] = normals[n].z;
  }
  for (const Block& block : blocks_of(p)) {
    for (Bundle& bundle : bundles) add(block, bundle);
  }
  std::vector<Rgb> result(normals.size());
  for (std::size_t n = 0; n < normals.size(); ++n) {
    const Bundle& bundle = bundles[n / lanes];
    result[n] = {bundle.r[n % lanes], bundle.g[n % lanes], bundle.b[n % lanes]};
  }
  return result;
}

IrradianceError irradiance_error(const std::vector<Rgb>& truth, const std::vector<Rgb>& estimate) {
  double error = 0, power = 0, weighted_error = 0, weighted_power = 0, largest = 0;
  for (std::size_t n = 0; n < truth.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double difference = estimate.at(n)[c] - truth[n][c];
      error += difference * difference;
      power += truth[n][c] * truth[n][c];
      weighted_error += luminance_weights[c] * difference * difference;
      weighted_power += luminance_weights[c] * truth[n][c] * truth[n][c];
      largest = std::max(largest, std::abs(difference));
    }
  }
  const double values = 3.0 * static_cast<double>(truth.size());
  return {ratio(error, power), ratio(weighted_error, weighted_power), ratio(largest * largest, power / values)};
}

}  // namespace lightwell::reference
