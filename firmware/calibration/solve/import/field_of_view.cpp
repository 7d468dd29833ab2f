#include "calibration/solve/import/field_of_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/model/camera_model.hpp"

namespace lightwell {

FieldOfView field_of_view(const LensParameters& lens) {
  LensParameters whole = lens;
  whole.max_angle_rad = std::numbers::pi;
  const CameraModel model(whole);
  FieldOfView out;
  out.model_rad = model.max_angle_rad();
  const auto centre = model.project({0, 0, 1});
  if (!centre) return out;
  // The edge of the picture is the outer edge of its outermost pixels.
  const double radius =
      std::min({centre->x + 0.5, lens.width - 0.5 - centre->x, centre->y + 0.5, lens.height - 0.5 - centre->y});
  if (!(radius > 0)) return out;
  double angle = out.model_rad;
  // Tangential distortion varies with the azimuth and its double: steps of half a degree suffice.
  constexpr int kAzimuths = 720;
  for (int i = 0; i < kAzimuths; ++i) {
    const double phi = 2 * std::numbers::pi * i / kAzimuths;
    const auto d = model.unproject({centre->x + radius * std::cos(phi), centre->y + radius * std::sin(phi)});
    // A point of the circle without a direction is beyond the model's domain, which model_rad already limits.
    if (d) angle = std::min(angle, std::atan2(std::hypot(d->x, d->y), d->z));
  }
  out.circle_rad = angle;
  return out;
}

}  // namespace lightwell
