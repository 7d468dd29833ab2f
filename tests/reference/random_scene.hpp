// Smooth light that nobody arranged: harmonics of random size and a few soft lamps.
#pragma once

#include <cstdint>
#include <vector>

#include "reference/vector.hpp"

namespace lightwell::reference {

/// A lamp whose radiance falls as a Gaussian of the angle.
struct SoftLamp {
  V3 towards;
  double deviation_rad = 0;
  Rgb peak{};
};

struct RandomScene {
  std::vector<Rgb> harmonics;  ///< Bands 0 to 6.
  std::vector<SoftLamp> lamps;
  double darkest = 0;  ///< No direction is darker.

  /// The same seed gives the same scene on every machine, between about 0 and 1 before its lamps; without lamps it
  /// is its harmonics, where these are above `darkest`.
  explicit RandomScene(std::uint32_t seed, int lamp_count = 3);
  [[nodiscard]] Rgb radiance(const V3& direction) const;
};

}  // namespace lightwell::reference
