// Projections of caps, for tests of the selection.
#pragma once

#include <cstddef>

#include <lightwell/cap.hpp>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// Adds the projection of a cap.
inline void add_cap(const Light& light, Projection& scene) {
  const BasisRow y = basis_row(vec_cast<double>(light.direction));
  std::size_t at = 0;
  const auto add = [&](int l) {
    for (int m = -l; m <= l; ++m, ++at)
      for (int c = 0; c < 3; ++c)
        scene.c[at][static_cast<std::size_t>(c)] +=
            light.irradiance[c] * cap_zonal(l, light.angular_radius_rad) * y[at];
  };
  for (int l = 0; l <= kMaxBand; ++l) add(l);
  for (const int l : kTailBands) add(l);
}

inline Light lamp(Vec3f direction, float irradiance, std::uint32_t track) {
  Light out;
  out.direction = normalized(direction);
  out.angular_radius_rad = 0.05F;
  out.irradiance = {irradiance, irradiance, irradiance};
  out.track = track;
  return out;
}

}  // namespace lightwell::estimate
