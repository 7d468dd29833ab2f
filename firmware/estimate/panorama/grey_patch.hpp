// Reads the irradiance at the normal of a Lambertian patch of known albedo that is always in view.
#pragma once

#include <optional>

#include <lightwell/config.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

class GreyPatchReader {
 public:
  GreyPatchReader(const GreyPatch& patch, const RigTable& table);

  /// Irradiance at the patch's normal: pi / albedo times its mean luminance, in the units of `reader`. nullopt where
  /// the patch is dark, saturated or not in the bracket.
  [[nodiscard]] std::optional<double> irradiance(RowReader& reader, const BlockLayout& layout);

 private:
  GreyPatch patch_;
  const RigTable& table_;
  LinearRow row_;
};

}  // namespace lightwell::estimate
