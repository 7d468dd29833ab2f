// The state of AlphaMaps.
#pragma once

#include <cstddef>
#include <vector>

#include <lightwell/relight.hpp>

namespace lightwell::relight {

/// alpha of one basis light, planes of red, green, blue.
struct AlphaMap {
  bool used = false;
  std::vector<float> planes;
};

struct AlphaData {
  std::size_t pixels = 0;
  std::vector<RgbFactor> weights;  ///< Constant, of each basis light.
  std::vector<AlphaMap> maps;      ///< Of each basis light.
  /// Direct light of pixels that no basis light of a pattern reaches; empty without such pixels.
  std::vector<Radiance> modelled;
};

}  // namespace lightwell::relight
