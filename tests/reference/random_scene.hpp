// Random smooth scenes: harmonics with random coefficients and a few soft lamps.
#pragma once

#include <cstdint>
#include <vector>

#include "reference/vector.hpp"

namespace lightwell::reference {

/// A lamp whose radiance is a Gaussian of the angle.
struct SoftLamp {
  V3 towards;
  double deviation_rad = 0;
  Rgb peak{};
};

struct RandomScene {
  std::vector<Rgb> harmonics;  ///< Bands 0 to 6.
  std::vector<SoftLamp> lamps;
  double darkest = 0;  ///< Minimum radiance of every direction.

  /// The same seed gives the same scene on every machine. Its background is between about 0 and 1; without lamps, the
  /// radiance is the series of its harmonics where that exceeds `darkest`.
  explicit RandomScene(std::uint32_t seed, int lamp_count = 3);
  [[nodiscard]] Rgb radiance(const V3& direction) const;
};

}  // namespace lightwell::reference
