// Which lights the saturated pixels of a frame belong to.
#pragma once

#include <lightwell/descriptor.hpp>
#include <span>
#include <vector>

#include "calibration/lens_table.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/row_reader.hpp"

namespace lightwell::estimate {

class ClippedLights {
 public:
  explicit ClippedLights(const RigTable& table);

  /// Fills `tracks` with the tracks of the lights that saturated pixels belong to; leaves it empty where too many of those
  /// belong to none. Reads the blocks again whose peak may be saturated: to be called only where sums.clipped_sr > 0.
  void find(RowReader& reader, const BlockLayout& layout, const BlockSums& sums, std::span<const Light> lights,
            std::vector<std::uint32_t>& tracks);

 private:
  const RigTable& table_;
  LinearRow row_;
};

}  // namespace lightwell::estimate
