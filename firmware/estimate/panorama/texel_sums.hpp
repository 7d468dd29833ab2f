// Mean radiance of the texels of an octahedral map, summed from pixels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/environment_updates.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

/// Reads all pixels of a frame again; for frames in which a map is due.
class TexelSums {
 public:
  /// Refers to `table` and `layout`.
  TexelSums(const RigTable& table, const BlockLayout& layout, const OctahedralGrid& grid);

  /// Whether texels are so much wider than pixels that sums by texel are more exact than sums by block.
  [[nodiscard]] static bool resolved(const RigTable& table, const OctahedralGrid& grid);

  /// By texel, the mean radiance of the pixels in it, and as fourth channel the weight with which the mean replaces
  /// that of other sources: 1 where pixels of the lenses present fill the texel, 0 where there are none. `exposures`:
  /// number of frames of the bracket. Valid until the next call; callers may change the elements. Allocates nothing.
  [[nodiscard]] std::span<Rgbx> run(RowReader& reader, std::size_t exposures);

 private:
  const RigTable& table_;
  const BlockLayout& layout_;
  std::vector<std::vector<std::uint16_t>> texel_;  ///< By lens and pixel.
  std::vector<float> inverse_solid_angle_;         ///< By texel.
  std::vector<Rgbx> texels_;
  LinearRow row_;
};

}  // namespace lightwell::estimate
