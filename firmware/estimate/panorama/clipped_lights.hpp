// What the recovery of clipped energy needs from a frame: the clipped lights, and the reading of a grey patch.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/descriptor.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/clipped_energy.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Assigns the saturated pixels of a frame to lights. Fills `tracks` with the tracks of the lights to which saturated
/// blocks belong. Leaves it empty where less than three quarters of the saturated solid angle belongs to lights.
/// `lights`: strongest first. Returns the index of the strongest one in `tracks`, or -1.
int find_clipped_lights(const BlockSums& sums, const CellGrid& grid, std::span<const Light> lights,
                        std::vector<std::uint32_t>& tracks);

/// Measures the irradiance at the normal of a Lambertian patch of known albedo that is always in view.
class GreyPatchReader {
 public:
  /// Refers to `table` and `layout`.
  GreyPatchReader(const GreyPatch& patch, const RigTable& table, const BlockLayout& layout);

  /// The irradiance is pi / albedo times the patch's mean luminance, in the units of `reader` times `factor`. nullopt
  /// where the patch is dark, saturated or not in the bracket.
  [[nodiscard]] std::optional<DiffuseConstraint> read(RowReader& reader, double factor);

 private:
  GreyPatch patch_;
  const RigTable& table_;
  const BlockLayout& layout_;
  LinearRow row_;
};

}  // namespace lightwell::estimate
