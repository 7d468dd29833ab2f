// True irradiance of a panorama, computed by the reference implementation (tests/reference).
#pragma once

#include <optional>
#include <vector>

#include <lightwell/lighting.hpp>

#include "reference/irradiance.hpp"
#include "reference/panorama.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {

/// True irradiance of a panorama at 2,048 normals (Fibonacci lattice). The panorama is interpolated bilinearly between
/// pixel centres, as in the simulator.
class LightTruth {
 public:
  explicit LightTruth(const PanoramaPixels& pixels);

  [[nodiscard]] reference::IrradianceError error_of(const Lighting& lighting) const;

 private:
  std::vector<reference::V3> normals_;
  std::vector<reference::Rgb> truth_;
};

/// The light nearest to a direction within `reach_rad`, if there is one.
[[nodiscard]] std::optional<Light> light_near(const Descriptor& descriptor, Vec3d direction, double reach_rad);

constexpr double kDegree = 3.14159265358979323846 / 180;

}  // namespace lightwell::test
