#include "calibration/model/pixel_vignetting.hpp"

#include <array>
#include <cmath>

#include "calibration/model/response.hpp"

namespace lightwell {

PixelVignetting::PixelVignetting(const LensParameters& lens) : photometry_(lens.photometry), model_(lens) {
  const auto width = static_cast<std::size_t>(lens.width), height = static_cast<std::size_t>(lens.height);
  const bool uniform = photometry_.vignetting == std::array<double, 3>{};
  stride_ = uniform ? 0 : width;
  inverse_.assign(uniform ? width : width * height, uniform ? 1.0F : 0.0F);
}

const float* PixelVignetting::inverse(int y, int first, int end) {
  float* const row = inverse_.data() + static_cast<std::size_t>(y) * stride_;
  for (int x = first; x < end; ++x)
    if (row[x] == 0) row[x] = evaluate(x, y);
  return row + first;
}

float PixelVignetting::evaluate(int x, int y) const {
  const auto d = model_.unproject({static_cast<double>(x), static_cast<double>(y)});
  const double angle = d ? std::atan2(std::hypot(d->x, d->y), d->z) : model_.max_angle_rad();
  return static_cast<float>(1 / vignetting(photometry_, angle));
}

}  // namespace lightwell
