#include "firmware/calibration/photometry/lamp_picture.hpp"

#include <cmath>

#include "calibration/model/camera_model.hpp"
#include "sim/sensor.hpp"

namespace lightwell::photometry {

LampCamera::LampCamera(const RigParameters& rig, PixelFormat format, std::uint64_t seed, double lamp_radius_rad)
    : lens_(rig.lenses.front()),
      format_(format),
      sensor_(lens_, sim::sensor_of(rig, format, seed)),
      radius_(lamp_radius_rad) {}

std::vector<std::byte> LampCamera::bytes(double angle_rad, double around_rad, double radiance, double exposure_s) {
  const CameraModel model(lens_);
  const Vec3d lamp{std::sin(angle_rad) * std::cos(around_rad), std::sin(angle_rad) * std::sin(around_rad),
                   std::cos(angle_rad)};
  const double least = std::cos(radius_), near = std::cos(radius_ + 0.03);
  constexpr int kFine = 8;
  std::vector<float> out;
  for (int y = 0; y < lens_.height; ++y)
    for (int x = 0; x < lens_.width; ++x) {
      double share = 0;
      const auto middle = model.unproject({static_cast<double>(x), static_cast<double>(y)});
      if (middle && dot(*middle, lamp) > near)
        for (int k = 0; k < kFine * kFine; ++k) {
          const auto d = model.unproject({x + (k % kFine + 0.5) / kFine - 0.5, y + (k / kFine + 0.5) / kFine - 0.5});
          share += d && dot(*d, lamp) >= least ? 1.0 / (kFine * kFine) : 0;
        }
      out.insert(out.end(), 3, middle ? static_cast<float>(radiance * (share + 0.001)) : 0.0F);
    }
  std::vector<std::byte> picture(sensor_.bytes());
  sensor_.expose(out, {exposure_s, 1, frame_++, 0}, picture);
  return picture;
}

Picture LampCamera::shoot(double angle_rad, double around_rad, double radiance, double exposure_s) {
  const std::vector<std::byte> picture = bytes(angle_rad, around_rad, radiance, exposure_s);
  return *picture_of({0, format_, lens_.width, lens_.height, sensor_.stride(), picture}, "lamp");
}

}  // namespace lightwell::photometry
