// What the light of a panorama truly is, by the oracles of tests/reference.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/lighting.hpp>

#include "reference/irradiance.hpp"
#include "reference/panorama.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {

/// The irradiance of a panorama, each pixel's neighbourhood taken bilinear as the simulator does,
/// at the house's 2,048 normals.
class LightTruth {
 public:
  explicit LightTruth(const PanoramaPixels& pixels);

  [[nodiscard]] reference::IrradianceError error_of(const Lighting& lighting) const;

 private:
  std::vector<reference::V3> normals_;
  std::vector<reference::Rgb> truth_;
};

/// The light nearest to a direction, where one is within `reach_rad`.
[[nodiscard]] std::optional<Light> light_near(const Descriptor& descriptor, Vec3d direction, double reach_rad);

constexpr double kDegree = 3.14159265358979323846 / 180;

}  // namespace lightwell::test
