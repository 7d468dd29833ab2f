// Simulated pictures of a dark room with one round lamp.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/pixel.hpp>

#include "calibration/solve/photometry/picture.hpp"
#include "sim/sensor.hpp"

namespace lightwell::photometry {

class LampCamera {
 public:
  LampCamera(const RigParameters& rig, PixelFormat format, std::uint64_t seed, double lamp_radius_rad = 0.05);

  /// The lamp is at `angle_rad` from the axis and azimuth `around_rad` from +x; the room has 1/1000 of its radiance.
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
