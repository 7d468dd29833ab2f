// Parameters of a fit of lights: their order in the vector that the solver changes.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

enum class Distance : std::uint8_t { infinite, free };

/// Layout of the parameter vector. Per light: rotation of its direction (u, v), inverse distance if that is free,
/// irradiance per channel. Per channel: four ambient coefficients. For the ground plane, its radiance under the ambient
/// light and under each light. Members are offsets; -1: absent.
struct FitLayout {
  struct LightParameters {
    int turn = 0, inverse = -1, irradiance = 0;
  };
  std::vector<LightParameters> lights;
  int ambient = 0, ground = -1, size = 0;

  FitLayout(const std::vector<Distance>& distances, int channels, bool with_ground) {
    for (const Distance d : distances) {
      LightParameters offsets;
      offsets.turn = size;
      size += 2;
      if (d == Distance::free) offsets.inverse = size++;
      offsets.irradiance = size;
      size += channels;
      lights.push_back(offsets);
    }
    ambient = size;
    size += 4 * channels;
    if (with_ground) {
      ground = size;
      size += 1 + static_cast<int>(distances.size());
    }
  }
};

/// A light's direction, the tangent vectors along which it rotates, and its inverse distance.
struct LightPose {
  Vec3d direction, u, v;
  double inverse_distance = 0;

  [[nodiscard]] Vec3d turned(double du, double dv) const { return normalized(direction + u * du + v * dv); }
  /// turned() and its derivatives by du and dv: the parts of u and v perpendicular to it.
  struct Turned {
    Vec3d direction, to_u, to_v;
  };
  [[nodiscard]] Turned turned_with_slopes(double du, double dv) const {
    const Vec3d raw = direction + u * du + v * dv;
    const double inverse = 1 / length(raw);
    const Vec3d d = raw * inverse;
    return {d, (u - d * dot(d, u)) * inverse, (v - d * dot(d, v)) * inverse};
  }
};

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace lightwell::marker
