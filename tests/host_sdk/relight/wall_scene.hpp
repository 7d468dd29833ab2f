// A matte wall in front of a camera, photographed under basis lights, in closed form.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/relight.hpp>

namespace lightwell::test {

/// The wall z = -2 m seen from the origin, in 40 x 30 pixels, 0.05 m each.
struct WallScene {
  RelightCamera camera{40, 30, 40, 20, 15, {}};
  Albedo albedo{0.8F, 0.5F, 0.2F};
  std::vector<BasisLight> basis;

  [[nodiscard]] std::vector<float> depth() const { return std::vector<float>(camera.pixels(), 2); }
  [[nodiscard]] std::vector<Albedo> albedos() const { return std::vector<Albedo>(camera.pixels(), albedo); }
  [[nodiscard]] RelightSubject subject() const {
    return RelightSubject::from_depth(camera, depth(), {albedos(), {}}).value();
  }
  [[nodiscard]] Vec3d point(std::size_t pixel) const {
    const auto column = static_cast<double>(pixel % 40), row = static_cast<double>(pixel / 40);
    return {(column + 0.5 - 20) * 0.05, -(row + 0.5 - 15) * 0.05, -2};
  }
  /// Radiance under a lamp of that intensity at that place.
  [[nodiscard]] Radiance lit(std::size_t pixel, Vec3d lamp, const Irradiance& intensity) const {
    const Vec3d to = lamp - point(pixel);
    const auto e = static_cast<float>(std::max(0.0, to.z) / (length(to) * dot(to, to)));
    return reflected_radiance(intensity * e, albedo);
  }
  [[nodiscard]] std::vector<std::vector<Radiance>> photographs() const {
    std::vector<std::vector<Radiance>> out;
    for (const BasisLight& light : basis) {
      out.emplace_back();
      for (std::size_t p = 0; p < camera.pixels(); ++p) out.back().push_back(lit(p, light.place, light.irradiance));
    }
    return out;
  }
};

inline std::vector<std::span<const Radiance>> spans_of(const std::vector<std::vector<Radiance>>& pictures) {
  return {pictures.begin(), pictures.end()};
}

/// A pattern that looks along -Z from a place, 2 atan(1/2) across.
inline PatternLight pattern_at(Vec3d place, int columns, int rows, std::span<const RgbFactor> picture) {
  PatternLight out;
  out.T_world_light.translation = place;
  out.field_of_view_rad = 2 * std::atan(0.5);
  out.columns = columns;
  out.rows = rows;
  out.picture = picture;
  return out;
}

}  // namespace lightwell::test
