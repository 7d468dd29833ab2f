// One lens of a simulated camera with all that rendering its pictures needs.
#pragma once

#include <cstdint>
#include <span>

#include "sim/flicker.hpp"
#include "sim/render.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell {

/// When the rows of a frame are exposed.
struct ExposureTiming {
  double readout_s = 0;  ///< From one row's exposure to the next row's.
  sim::MainsFlicker flicker;
  double frame_rate = 30;  ///< At which the pictures of a flickering scene follow each other.
  bool takes_time = true;  ///< False for the ideal sensor, whose exposures are instants.
};

struct LensRenderer {
  sim::LensRays rays;
  sim::Sensor sensor;
  ExposureTiming timing;

  /// Light of a frame before any flicker, row by row where a rolling shutter sees a probe that turns. `out`: r g b a
  /// pixel of the whole picture.
  void radiance(const sim::Scene& scene, std::uint64_t index, std::span<float> out) const;
  /// `steady` as the flicker leaves it for each row of a picture. Frames are due at even times, and exposed before.
  void flicker(std::uint64_t index, double exposure_s, std::span<const float> steady, std::span<float> out) const;
};

/// Whether two frames of a scene show the same light: a probe at rest sees only its lamps switch.
[[nodiscard]] bool same_light(const sim::Scene& scene, std::uint64_t index, std::uint64_t other);

}  // namespace lightwell
