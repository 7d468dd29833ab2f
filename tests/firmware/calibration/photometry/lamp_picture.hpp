// A dark room with one round lamp, through a lens of firmware/sim.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>

#include "calibration/photometry/picture.hpp"
#include "sim/sensor.hpp"

namespace lightwell::photometry {

class LampCamera {
 public:
  LampCamera(const RigParameters& rig, PixelFormat format, std::uint64_t seed, double lamp_radius_rad = 0.05);

  /// The lamp at `angle_rad` from the axis, `around_rad` round it from +x, in a room of a thousandth of its radiance.
  [[nodiscard]] std::vector<std::byte> bytes(double angle_rad, double around_rad, double radiance, double exposure_s);
  [[nodiscard]] Picture shoot(double angle_rad, double around_rad, double radiance, double exposure_s);

 private:
  LensParameters lens_;
  PixelFormat format_;
  sim::Sensor sensor_;
  double radius_;
  std::uint64_t frame_ = 0;
};

}  // namespace lightwell::photometry
