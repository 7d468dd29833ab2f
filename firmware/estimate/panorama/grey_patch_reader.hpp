// A grey patch in the picture that tells the irradiance of lights that every exposure clips (common/clipped_energy).
#pragma once

#include <optional>

#include <lightwell/config.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/clipped_energy.hpp"
#include "estimate/frames/block_layout.hpp"
#include "estimate/frames/row_reader.hpp"

namespace lightwell::estimate {

/// Measures the irradiance at the normal of a Lambertian patch of known albedo that is always in view.
class GreyPatchReader {
 public:
  /// Refers to `table` and `layout`.
  GreyPatchReader(const GreyPatch& patch, const RigTable& table, const BlockLayout& layout)
      : patch_(patch), table_(table), layout_(layout), row_(table.lenses[static_cast<std::size_t>(patch.lens)].width) {}

  /// pi / albedo times the mean luminance, in `reader`'s units times `factor`. nullopt: dark, saturated, missing.
  [[nodiscard]] std::optional<DiffuseConstraint> read(RowReader& reader, double factor);

 private:
  GreyPatch patch_;
  const RigTable& table_;
  const BlockLayout& layout_;
  LinearRow row_;
};

}  // namespace lightwell::estimate
