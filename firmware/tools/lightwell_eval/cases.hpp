// The cases of the sweep: cameras and configurations of the estimator.
#pragma once

#include <string>
#include <vector>

#include <lightwell/estimator_config.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell::eval {

/// The parameter that a case varies; determines its colour in the chart.
enum class SweepParameter { setting, block, band, lights, epsilon, map, sensor };
[[nodiscard]] std::string_view to_string(SweepParameter parameter);

/// The sensor for the error. Times are always measured with rgb8 pictures.
enum class Sensor {
  ideal,      ///< Floating-point radiance without noise: the error of the estimator alone.
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
  bool named = false;  ///< One of the three named settings.

  /// Whether both cases have the same camera and sensor, so that they are compared.
  [[nodiscard]] bool competes_with(const Case& o) const {
    return width == o.width && height == o.height && sensor == o.sensor;
  }
};

[[nodiscard]] std::vector<Case> all_cases();

}  // namespace lightwell::eval
