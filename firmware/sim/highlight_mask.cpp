#include "sim/highlight_mask.hpp"

#include <algorithm>

namespace lightwell::sim {

HighlightMask::HighlightMask(const Panorama& panorama)
    : width_(static_cast<std::uint64_t>(panorama.width)),
      height_(static_cast<std::uint64_t>(panorama.height)),
      mask_(width_ * height_, 0) {
  constexpr double kTimesMean = 50;
  const auto threshold = static_cast<float>(kTimesMean * mean_luminance(panorama));
  const int width = panorama.width;
  for (int j = 0; j < panorama.height; ++j) {
    for (int i = 0; i < width; ++i) {
      if (!(panorama.pixel(i, j).luminance() > threshold)) continue;
      for (int row = std::max(j - 1, 0); row <= std::min(j + 1, panorama.height - 1); ++row) {
        for (const int column : {(i + width - 1) % width, i, (i + 1) % width})
          mask_[static_cast<std::size_t>(row * width + column)] = 1;
      }
    }
  }
}

}  // namespace lightwell::sim
