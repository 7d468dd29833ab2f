#include "estimate/specular/lumisphere.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include <lightwell/specular_brdf.hpp>

namespace lightwell::specular {
namespace {

/// The two neighbours of the same level and the nearest node of the levels above and below.
std::array<std::size_t, 4> neighbours(const HemisphereGrid& grid, std::size_t node) {
  const int level = grid.level_of(node), count = HemisphereGrid::nodes_of(level);
  const std::size_t first = HemisphereGrid::first_of(level);
  const auto along = static_cast<int>(node - first);
  const auto beside = [&](int other) { return other < 0 || other > grid.levels() ? node : grid.on_level(node, other); };
  return {first + static_cast<std::size_t>((along + 1) % count),
          first + static_cast<std::size_t>((along + count - 1) % count), beside(level - 1), beside(level + 1)};
}

/// Reflectance of a smooth surface towards a node.
float reflectance(const HemisphereGrid& grid, std::size_t node) {
  return SpecularBrdf{}.fresnel(static_cast<float>(grid.direction(node).z));
}

}  // namespace

void fill_unseen(Lumisphere& lumisphere) {
  const std::size_t size = lumisphere.grid.size();
  std::vector<std::uint8_t> known(size);
  std::size_t missing = 0;
  for (std::size_t node = 0; node < size; ++node) {
    known[node] = lumisphere.weight[node] > 0 ? 1 : 0;
    missing += 1U - known[node];
  }
  std::vector<std::size_t> filled;
  while (missing > 0 && missing < size) {
    filled.clear();
    for (std::size_t node = 0; node < size; ++node) {
      if (known[node] != 0) continue;
      Radiance sum;
      float count = 0, clipped = 0;
      for (const std::size_t other : neighbours(lumisphere.grid, node)) {
        if (known[other] == 0) continue;
        sum += lumisphere.value[other] * (1 / reflectance(lumisphere.grid, other));
        clipped += static_cast<float>(lumisphere.clipped[other]);
        ++count;
      }
      if (!(count > 0)) continue;
      lumisphere.clipped[node] = 2 * clipped > count ? 1 : 0;
      lumisphere.value[node] = sum * (reflectance(lumisphere.grid, node) / count);
      filled.push_back(node);
    }
    if (filled.empty()) return;
    for (const std::size_t node : filled) known[node] = 1;
    missing -= filled.size();
  }
}

}  // namespace lightwell::specular
