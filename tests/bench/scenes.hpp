// Scenes for the peers' tests, made with tests/reference.
#pragma once

#include <vector>

#include "bench/equirect_image.hpp"
#include "reference/irradiance.hpp"
#include "reference/panorama.hpp"

namespace lightwell::bench::scenes {

namespace ref = lightwell::reference;

/// An image for the peers, and the same values for the reference implementation.
struct Scene {
  std::vector<float> pixels;
  ref::Panorama panorama;

  explicit Scene(const ref::Panorama& p)
      : pixels(p.rgb.begin(), p.rgb.end()), panorama{p.width, p.height, {pixels.begin(), pixels.end()}} {}
  [[nodiscard]] EquirectImage image() const { return {panorama.width, panorama.height, pixels}; }
};

/// A scene that detects any wrong sign, axis or order: every harmonic of bands 0 to 2 occurs in some colour.
inline ref::Panorama smooth(int width) {
  const ref::RadianceFunction f = [](const ref::V3& d) {
    return ref::Rgb{2 + d.x + 0.3 * d.x * d.y, 2 + d.y + 0.5 * d.y * d.z + 0.4 * d.z * d.z,
                    2 + d.z + 0.6 * d.x * d.z + 0.7 * d.x * d.x};
  };
  return ref::from_function(width, width / 2, f, 1);
}

/// A warm lamp with a radius of 3 degrees in a non-uniform room.
inline ref::Panorama lamp_in_room(int width, const ref::V3& direction) {
  return ref::sum(smooth(width),
                  ref::disc_lamp(width, width / 2, ref::normalised(direction), 0.052, {900, 700, 400}, 8));
}

template <typename Output>
ref::IrradianceError error_of(const ref::Panorama& truth, const Output& output) {
  const auto normals = ref::fibonacci_normals(512);
  std::vector<ref::Rgb> got;
  for (const ref::V3& n : normals) got.push_back(irradiance_of(output, {n.x, n.y, n.z}));
  return ref::irradiance_error(ref::irradiance_at(truth, normals), got);
}

}  // namespace lightwell::bench::scenes
