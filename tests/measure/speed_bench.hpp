// How long an estimator takes from frame to encoded descriptor, beside memcpy of the same bytes in the same run.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>

#include "sim/scene.hpp"

namespace lightwell::measure {

struct SpeedCase {
  std::string rig = "equirect";  ///< sim::make_rig's name.
  int width = 1280, height = 960;
  PixelFormat format = PixelFormat::rgb8;
  bool linear = false;  ///< Response of the sensor: linear, or as the rig has it.
  std::vector<double> exposures{1e-3};
  EstimatorConfig config;
  /// So many copies of the bracket take turns, so that no cache holds one. Fewer do for pictures of tens of megabytes.
  std::size_t buffers = 32;
};

struct Speed {
  double seconds = 0;         ///< Of one descriptor; best of five passes over all buffers.
  double memcpy_seconds = 0;  ///< Of copying the bytes of one bracket; best of five that take turns with those.
  double bytes = 0;           ///< Of one bracket.
  double descriptor_bytes = 0;
  int lights = 0;
};

[[nodiscard]] Speed measure_speed(const sim::Scene& scene, const SpeedCase& c);

}  // namespace lightwell::measure
