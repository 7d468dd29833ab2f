// Which share of each pixel outlines cover, exactly: what makes a drawn page true to scale to a fraction of its pixels.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/lightwell_calibrate/page.hpp"

namespace lightwell::calibrate {

/// Of the pixels around the outlines; those outside of it are not covered.
struct Coverage {
  int left = 0, top = 0;  ///< Pixel of the page that (0, 0) is.
  int width = 0, height = 0;
  std::vector<float> share;  ///< Row by row, 0 to 1.

  [[nodiscard]] float at(int x, int y) const { return share[static_cast<std::size_t>(y * width + x)]; }
};

/// Outlines in mm, `scale` pixels a mm. Those that overlap run the same way round; where they do the share is cut off
/// at 1.
[[nodiscard]] Coverage coverage_of(const std::vector<std::vector<PagePoint>>& outlines, double scale);

}  // namespace lightwell::calibrate
