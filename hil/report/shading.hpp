// Renders the picture's balls and still life, lit by a descriptor or by the true panorama.
#pragma once

#include <functional>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

#include "report/samples.hpp"

namespace lightwell::hil {

/// Linear radiance, rows from the top; alpha is the coverage, 0 for the background.
struct LinearPicture {
  int width = 0, height = 0;
  std::vector<Radiance> pixels;
  std::vector<float> alpha;

  LinearPicture(int w, int h)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)), alpha(pixels.size()) {}
};

/// A ball of `edge` pixels in orthographic view from +Z; `shade` gets the normal and the mirrored view direction.
[[nodiscard]] LinearPicture ball(int edge, const std::function<Radiance(Vec3f normal, Vec3f mirrored)>& shade);

/// A ball and a block on a matte floor, seen from the front and above, with direct light and shadows.
[[nodiscard]] LinearPicture still_life(int width, int height, const std::vector<LightSample>& light);

/// radiance(d, roughness) of light samples by its definition: the mean weighted by GGX and N·L.
[[nodiscard]] Radiance glossy(const std::vector<LightSample>& light, Vec3f direction, double roughness);
/// Irradiance of light samples on a surface with this normal.
[[nodiscard]] Irradiance diffuse(const std::vector<LightSample>& light, Vec3f normal);

}  // namespace lightwell::hil
