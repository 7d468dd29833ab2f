// The three balls and a small object with its shadow, lit by a descriptor and by the truth.
#pragma once

#include <functional>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

#include "report/samples.hpp"

namespace lightwell::hil {

/// Linear radiance, rows from the top; alpha 0 where nothing is.
struct LinearPicture {
  int width = 0, height = 0;
  std::vector<Radiance> pixels;
  std::vector<float> alpha;

  LinearPicture(int w, int h)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)), alpha(pixels.size()) {}
};

/// A ball of `edge` pixels seen from +Z, far away; `shade` gets the normal and the mirrored view direction.
[[nodiscard]] LinearPicture ball(int edge, const std::function<Radiance(Vec3f normal, Vec3f mirrored)>& shade);

/// A ball and a block on a matte floor, seen from in front and above, direct light with shadows.
[[nodiscard]] LinearPicture still_life(int width, int height, const std::vector<LightSample>& light);

/// radiance(d, r) of a list of directions, by the definition: the mean weighted by GGX and N·L.
[[nodiscard]] Radiance glossy(const std::vector<LightSample>& light, Vec3f direction, double roughness);
/// Irradiance of a list of directions.
[[nodiscard]] Irradiance diffuse(const std::vector<LightSample>& light, Vec3f normal);

}  // namespace lightwell::hil
