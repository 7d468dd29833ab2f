// Derives the field of view of an imported lens; none of the formats contains it.
#pragma once

#include <optional>

#include <lightwell/calibration.hpp>

namespace lightwell {

struct FieldOfView {
  double model_rad = 0;  ///< Largest angle of the model's domain, at most pi.
  /// The largest angle that projects, at every azimuth, into the largest circle about the principal point that fits
  /// into the picture. Empty if the principal point is outside the picture.
  std::optional<double> circle_rad;
};

/// `lens.max_angle_rad` is ignored.
[[nodiscard]] FieldOfView field_of_view(const LensParameters& lens);

}  // namespace lightwell
