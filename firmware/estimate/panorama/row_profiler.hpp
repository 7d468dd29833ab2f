// Mean radiance along the rows of a frame, for FlickerDetector: of a single frame from its block sums, of one exposure
// of a bracket from a sample of its pixels. Rows of merged exposures have no common time.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/flicker.hpp"
#include "estimate/panorama/blocks.hpp"
#include "imaging/frame.hpp"

namespace lightwell::estimate {

class RowProfiler {
 public:
  /// Refers to all arguments but `rig`. `grid`: its cells are the blocks of `layout`.
  RowProfiler(const RigParameters& rig, const RigTable& table, const BlockLayout& layout, const CellGrid& grid);

  /// Profiles by row of blocks, one for each lens of the rig, valid until the next call; empty where a lens is missing.
  /// `frame` must have passed RowReader::bind(). `blocks`: sums of this frame alone.
  std::span<const RowProfile> profile(const Frame& frame, const BlockSums& blocks);
  /// The same by row of pixels, one of sixteen. Empty for floats, too, which are not exposures.
  std::span<const RowProfile> profile(const Frame& exposure);

 private:
  struct Lens {
    /// Linear value of green by code, for each depth of kCodeBits, and by luma (of grey). NaN where saturated.
    std::array<std::vector<float>, kCodeBits.size()> codes;
    std::vector<float> luma;
    int group_rows = 0;
    std::vector<float> radiance;
  };

  const RigTable& table_;
  const BlockLayout& layout_;
  const CellGrid& grid_;
  std::vector<Lens> lenses_;
  std::array<RowProfile, kMaxLenses> profiles_;
};

}  // namespace lightwell::estimate
