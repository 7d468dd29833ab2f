// The field of view, of which no format says anything.
#pragma once

#include <optional>

#include <lightwell/calibration.hpp>

namespace lightwell {

struct FieldOfView {
  double model_rad = 0;  ///< Where the model itself ends, at most pi.
  /// The largest angle whose directions, whatever their azimuth, land inside the largest circle round the principal
  /// point that fits into the picture. Nothing where the principal point is outside.
  std::optional<double> circle_rad;
};

/// Of a lens whose max_angle_rad is not known yet.
[[nodiscard]] FieldOfView field_of_view(const LensParameters& lens);

}  // namespace lightwell
