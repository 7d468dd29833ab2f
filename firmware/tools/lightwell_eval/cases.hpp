// What is swept: cameras, and configurations of the estimator.
#pragma once

#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell::eval {

/// What one row of the table varies; a colour in the picture.
enum class SweepParameter { setting, block, band, lights, epsilon, map, sensor };
[[nodiscard]] std::string_view to_string(SweepParameter parameter);

/// What the error is measured through. Time is always that of rgb8 pictures.
enum class Sensor {
  ideal,      ///< Floating-point radiance without noise: what the estimator itself gets wrong.
  eight_bit,  ///< rgb8 with noise, vignetting and saturation.
};

struct Case {
  std::string label;
  SweepParameter parameter = SweepParameter::setting;
  int width = 640, height = 480;  ///< Of each picture of the pair.
  Sensor sensor = Sensor::ideal;
  int exposures = 1;
  int block_edge = 0;  ///< PanoramaOptions::block_edge.
  EstimatorConfig config;
  bool named = false;  ///< One of the three settings as it is chosen by name.

  /// Cases of one camera and sensor compete.
  [[nodiscard]] bool rivals(const Case& o) const {
    return width == o.width && height == o.height && sensor == o.sensor;
  }
};

[[nodiscard]] std::vector<Case> all_cases();

}  // namespace lightwell::eval
