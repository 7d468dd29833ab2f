// A matte patch of known reflectance that the camera sees all the time: it reads the irradiance at its normal.
#pragma once

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>
#include <optional>

#include "calibration/lens_table.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/row_reader.hpp"

namespace lightwell {

/// Where it is and what it is made of. It must lie in the light that the probe measures, and be matte.
struct GreyPatch {
  int lens = 0;
  int x = 0, y = 0, width = 0, height = 0;  ///< Pixels of that lens, all on the patch.
  Vec3f normal{0, 1, 0};                    ///< Unit, probe frame.
  double albedo = 0.18;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate(const RigParameters& rig) const;
};

namespace estimate {

class GreyPatchReader {
 public:
  GreyPatchReader(const GreyPatch& patch, const RigTable& table);

  /// Irradiance at its normal: pi / albedo times its mean luminance, in units of what `reader` reads. None where the
  /// patch is dark, saturated or not in the bracket.
  [[nodiscard]] std::optional<double> irradiance(RowReader& reader, const BlockLayout& layout);

 private:
  GreyPatch patch_;
  const RigTable& table_;
  LinearRow row_;
};

}  // namespace estimate
}  // namespace lightwell
