// Renders the pictures of one lens of the simulated camera.
#pragma once

#include <cstdint>
#include <span>

#include "sim/flicker.hpp"
#include "sim/render.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell {

/// Times of exposure of the rows of a frame.
struct ExposureTiming {
  double readout_s = 0;  ///< Delay between successive rows.
  sim::MainsFlicker flicker;
  double frame_rate = 30;  ///< 1/s; frame times of a flickering scene.
  bool takes_time = true;  ///< False for the ideal sensor, whose exposures have no duration.
};

struct LensRenderer {
  sim::LensRays rays;
  sim::Sensor sensor;
  ExposureTiming timing;

  /// Radiance of a frame without flicker; row by row if the probe rotates under a rolling shutter. `out`: r, g, b per
  /// pixel, whole picture.
  void radiance(const sim::Scene& scene, std::uint64_t index, std::span<float> out) const;
  /// Multiplies `steady` by the mean flicker of each row's exposure. Frame times are equally spaced; exposures precede
  /// them.
  void flicker(std::uint64_t index, double exposure_s, std::span<const float> steady, std::span<float> out) const;
};

/// Whether two frames show the same radiance: for a probe at rest, whether the lamps have the same state.
[[nodiscard]] bool same_light(const sim::Scene& scene, std::uint64_t index, std::uint64_t other);

}  // namespace lightwell
