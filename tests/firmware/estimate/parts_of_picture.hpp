// Whether a pass that reads a part of the blocks gives them what it gives when it reads all, and leaves the others.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "estimate/panorama/blocks.hpp"

namespace lightwell::test {

/// The first difference in words; empty where there is none. `whole`: of all blocks. Parts of one to five blocks.
template <class Pass, class Frames>
std::string difference_of_parts(Pass& pass, const Frames& frames, const estimate::BlockSums& whole,
                                const estimate::BlockLayout& layout) {
  constexpr float kGuard = 12345;
  std::vector<std::uint8_t> read(layout.size());
  for (std::size_t i = 0; i < read.size(); ++i) read[i] = i % 13 < 5 || i % 13 == 8 ? 1 : 0;
  estimate::BlockSums part(layout);
  const auto arrays = [](auto& sums) {
    return std::vector{&sums.peak, &sums.offset_x, &sums.offset_y, &sums.clipped, &sums.block_noise, &sums.block_bias};
  };
  for (auto* values : arrays(part)) std::fill(values->begin(), values->end(), kGuard);
  pass.run(frames, read, {}, part);
  for (std::size_t i = 0; i < read.size(); ++i) {
    // Blocks without a pixel are in no part.
    if (!(layout.pixel_sr(i) > 0)) continue;
    const bool same_sum = part.sum[i].r == whole.sum[i].r && part.sum[i].g == whole.sum[i].g;
    if (same_sum != (read[i] != 0) && whole.sum[i].g != 0) return "sum of block " + std::to_string(i);
    for (std::size_t k = 0; k < arrays(part).size(); ++k) {
      const float got = (*arrays(part)[k])[i], expected = read[i] != 0 ? (*arrays(whole)[k])[i] : kGuard;
      if (got != expected)
        return "array " + std::to_string(k) + " of block " + std::to_string(i) + ": " + std::to_string(got) +
               " instead of " + std::to_string(expected);
    }
  }
  return "";
}

}  // namespace lightwell::test
