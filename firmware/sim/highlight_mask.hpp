// Marks the pixels of a panorama that are so bright that the renderer must supersample them.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/panorama.hpp"

namespace lightwell::sim {

/// The pixels of a panorama above 50 times its mean luminance, and their eight neighbours, because bilinear
/// interpolation spreads them that far.
class HighlightMask {
 public:
  HighlightMask() = default;
  explicit HighlightMask(const Panorama& panorama);

  [[nodiscard]] bool at(SpherePoint point) const {
    const auto column = static_cast<std::size_t>(point.u * width_ >> 32);
    const auto row = static_cast<std::size_t>(point.v * height_ >> 32);
    return mask_[row * width_ + column] != 0;
  }

 private:
  std::uint64_t width_ = 0, height_ = 0;
  std::vector<std::uint8_t> mask_;
};

}  // namespace lightwell::sim
