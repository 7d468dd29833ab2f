// Measures the irradiance at the normal of a Lambertian patch of known albedo that is always in view.
#pragma once

#include <optional>

#include <lightwell/config.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/clipped_energy.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

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
