// The samples of probes in the world frame, and their lights as observations.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/field.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell::field {

/// A sample in the world's axes.
struct ProbeView {
  Vec3d origin;         ///< Where the light holds, m.
  RadianceSh radiance;  ///< Without the lights. Times `scale` it has the common scale; so have the lights.
  std::vector<Light> lights;
  std::array<double, 6> pose_sigma{};  ///< Standard deviations: rotation about x, y, z (rad), translation (m).
  /// Samples with the same number share their calibration's unknown factor.
  std::uint64_t calibration = 0;
  bool absolute = false;
  double scale = 1;
  bool scale_known = true;  ///< `scale` brings it to the common scale.
};

[[nodiscard]] ProbeView view_of(const FieldSample& sample);

/// A light of a view.
struct Observation {
  std::size_t view = 0, light = 0;
  Vec3d origin, direction;         ///< Direction: unit, TOWARDS the light.
  double sigma_rad = 0;            ///< Of the direction in each tangent, with the rotation of the pose.
  double luminance = 0;            ///< Of the irradiance, common scale.
  std::array<double, 2> chroma{};  ///< log(r/g), log(b/g).
  double radius_rad = 0;
  double distance_m = 0, distance_sigma_m = 0;  ///< 0: not measured.
};

/// All lights of all views with a luminance and a direction, by view and by falling luminance.
[[nodiscard]] std::vector<Observation> observations_of(std::span<const ProbeView> views);

[[nodiscard]] double luminance_of(const Irradiance& e);

}  // namespace lightwell::field
