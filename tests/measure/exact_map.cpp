#include "measure/exact_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightwell::measure {

namespace ref = reference;

namespace {

/// Parts along the edge of a pixel, each of which belongs to one texel.
constexpr int kParts = 4;

/// Place in the unit square: the upper half of the sphere in the inner diamond, the lower half folded outwards.
std::array<double, 2> place_of(const ref::V3& d) {
  const double sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  double a = d.x / sum, b = d.z / sum;
  if (d.y < 0) {
    const double folded = (1 - std::abs(b)) * (a < 0 ? -1 : 1);
    b = (1 - std::abs(a)) * (b < 0 ? -1 : 1);
    a = folded;
  }
  return {(a + 1) / 2, (b + 1) / 2};
}

}  // namespace

ExactMap::ExactMap(const ref::Panorama& panorama, int edge)
    : edge_(edge), texels_(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge)) {
  std::vector<double> weights(texels_.size());
  const int width = panorama.width * kParts, height = panorama.height * kParts;
  for (int j = 0; j < height; ++j) {
    const double top = ref::pi * (0.5 - static_cast<double>(j) / height), bottom = top - ref::pi / height;
    const double weight = std::sin(top) - std::sin(bottom), middle = (top + bottom) / 2;
    for (int i = 0; i < width; ++i) {
      const double phi = 2 * ref::pi * ((i + 0.5) / width - 0.5);
      const auto [u, v] =
          place_of({std::cos(middle) * std::sin(phi), std::sin(middle), -std::cos(middle) * std::cos(phi)});
      const auto cell = [&](double x) { return std::min(static_cast<int>(x * edge), edge - 1); };
      const std::size_t texel = index(cell(u), cell(v));
      const std::size_t pixel = 3 * (static_cast<std::size_t>(j / kParts) * static_cast<std::size_t>(panorama.width) +
                                     static_cast<std::size_t>(i / kParts));
      for (std::size_t c = 0; c < 3; ++c) texels_[texel][c] += weight * panorama.rgb[pixel + c];
      weights[texel] += weight;
    }
  }
  for (std::size_t k = 0; k < texels_.size(); ++k)
    for (double& c : texels_[k]) c /= weights[k];
}

/// column, row: -1 to edge. Beyond an edge the sphere continues at the same edge, mirrored at its middle.
std::size_t ExactMap::index(int column, int row) const {
  if (column < 0 || column >= edge_) column = std::clamp(column, 0, edge_ - 1), row = edge_ - 1 - row;
  if (row < 0 || row >= edge_) row = std::clamp(row, 0, edge_ - 1), column = edge_ - 1 - column;
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(edge_) + static_cast<std::size_t>(column);
}

ref::Rgb ExactMap::radiance(const ref::V3& unit_direction) const {
  const auto [u, v] = place_of(unit_direction);
  const double x = u * edge_ - 0.5, y = v * edge_ - 0.5, left = std::floor(x), top = std::floor(y);
  ref::Rgb out{};
  for (int dj = 0; dj < 2; ++dj)
    for (int di = 0; di < 2; ++di) {
      const double weight = (di == 0 ? 1 - (x - left) : x - left) * (dj == 0 ? 1 - (y - top) : y - top);
      const ref::Rgb& texel = texels_[index(static_cast<int>(left) + di, static_cast<int>(top) + dj)];
      for (std::size_t c = 0; c < 3; ++c) out[c] += weight * texel[c];
    }
  return out;
}

}  // namespace lightwell::measure
