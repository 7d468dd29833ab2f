// Exact area coverage of pixels by polygons, for pages that are true to scale to a fraction of a pixel.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/lightwell_calibrate/page.hpp"

namespace lightwell::calibrate {

/// Coverage of the pixels in the bounding box of the outlines; all others are not covered.
struct Coverage {
  int left = 0, top = 0;  ///< Position of the box on the page, px.
  int width = 0, height = 0;
  std::vector<float> share;  ///< Row by row, 0 to 1.

  [[nodiscard]] float at(int x, int y) const { return share[static_cast<std::size_t>(y * width + x)]; }
};

/// `outlines` in mm, `scale` in pixels per mm. Overlapping outlines must have the same orientation; their coverage is
/// limited to 1.
[[nodiscard]] Coverage coverage_of(const std::vector<std::vector<PagePoint>>& outlines, double scale);

}  // namespace lightwell::calibrate
