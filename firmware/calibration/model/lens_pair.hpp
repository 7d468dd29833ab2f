// Poses of two lenses in the probe frame.
#pragma once

#include <array>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// T_probe_lens of both lenses, axes _cv, from T_c1_c0 (maps points from lens 0's frame to lens 1's). The probe's
/// origin is midway between the lenses, its -Z is lens 0's axis, and lens 0's picture is upright.
[[nodiscard]] inline std::array<Pose, 2> pair_in_probe(const Pose& second_from_first) {
  const Quat first_from_second = second_from_first.rotation.inverse();
  // Position of lens 1 in lens 0's frame.
  const Vec3d place = -rotate(first_from_second, second_from_first.translation);
  const Vec3d half = rotate(upright_lens_cv(), place) * 0.5;
  return {Pose{upright_lens_cv(), -half}, Pose{(upright_lens_cv() * first_from_second).normalized(), half}};
}

}  // namespace lightwell
