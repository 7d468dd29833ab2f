// Captured planes with a known appearance, for tests of the wire and of the SDK.
#pragma once

#include <cmath>
#include <cstdint>

#include <lightwell/captured_plane.hpp>

namespace lightwell::test {

/// Diffuse radiance at a point of the texture, in its frame. Linear in x and y, so that bilinear interpolation between
/// texels is exact.
inline Radiance linear_diffuse(double x_m, double y_m) {
  return {static_cast<float>(0.5 + 2 * x_m), static_cast<float>(0.4 - 1.5 * y_m), static_cast<float>(0.3 + x_m + y_m)};
}

/// Specular radiance at a direction given by its angles: linear in theta, and constant in phi.
inline Radiance linear_specular(double theta_rad) {
  const auto s = static_cast<float>(0.1 + 0.5 * theta_rad);
  return {s, 0.5F * s, 2 * s};
}

inline double texel_center(int i, int edge, double size_m) { return ((i + 0.5) / edge - 0.5) * size_m; }

/// All texels and directions are measured, with the radiance of the two functions above.
inline CapturedPlane linear_plane(int edge = 64, int lumisphere_levels = 20, int coverage_levels = 12) {
  CapturedPlane out;
  out.info.capture = 0xC0FFEE;
  out.info.mid_exposure = {5'000'000'000};
  out.info.size_m = 0.2;
  out.texture.edge = edge;
  for (int j = 0; j < edge; ++j)
    for (int i = 0; i < edge; ++i)
      out.texture.radiance.push_back(linear_diffuse(texel_center(i, edge, 0.2), -texel_center(j, edge, 0.2)));
  out.texture.state.assign(out.texture.count(), SampleState::measured);
  out.lumisphere.grid = HemisphereGrid(lumisphere_levels);
  for (std::size_t n = 0; n < out.lumisphere.grid.size(); ++n)
    out.lumisphere.radiance.push_back(
        linear_specular(out.lumisphere.grid.level_of(n) * out.lumisphere.grid.spacing_rad()));
  out.lumisphere.state.assign(out.lumisphere.grid.size(), SampleState::measured);
  out.coverage.grid = HemisphereGrid(coverage_levels);
  out.coverage.seen.assign(out.coverage.grid.size(), 1);
  return out;
}

}  // namespace lightwell::test
