// A room with tags on its walls, and simulated observations of them.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/pose/tags_around.hpp"
#include "pose/mounting.hpp"

namespace lightwell::test {

inline constexpr double kPi = std::numbers::pi;

/// Two fisheye lenses back to back, each 1 cm in front of the probe's origin.
inline RigParameters pair_rig(int edge = 960) {
  RigParameters rig;
  rig.lenses = {fisheye_lens(edge), fisheye_lens(edge)};
  rig.lenses[0].pose_cv.translation = {0, 0, -0.01};
  rig.lenses[1].pose_cv = {Quat{0, 0, 1, 0}, {0, 0, 0.01}};
  return rig;
}

/// Tags of 16 cm on four walls of a room of 4 x 4 m, 2.5 m high, the origin in the middle of its floor.
inline std::vector<WorldTag> tags_on_walls() {
  std::vector<WorldTag> out;
  int id = 0;
  for (int wall = 0; wall < 4; ++wall) {
    const Quat turn = Quat::about({0, 1, 0}, wall * kPi / 2);
    for (const double x : {-0.7, 0.6})
      out.push_back({TagFamily::tag36h11, id++, 0.16, {turn, rotate(turn, Vec3d{x, 1.2 + 0.3 * (id % 3), -2.0})}});
  }
  return out;
}

inline Pose probe_in_room() {
  return {(Quat::about({0, 1, 0}, 0.4) * Quat::about({1, 0, 0}, -0.1) * Quat::about({0, 0, 1}, 0.05)).normalized(),
          {0.3, 1.3, -0.4}};
}

/// Observations of all completely visible tags, with Gaussian corner noise of `sigma_px` in each coordinate.
inline std::vector<TagObservation> simulate_observations(const RigParameters& rig, const std::vector<WorldTag>& room,
                                                         const Pose& world_probe, double sigma_px, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<TagObservation> out;
  for (std::size_t l = 0; l < rig.lenses.size(); ++l) {
    const LensParameters& lens = rig.lenses[l];
    const CameraModel model(lens);
    const Pose lens_world = compose(inverse(lens.pose_cv), inverse(world_probe));
    for (const WorldTag& tag : room) {
      const Pose lens_tag = compose(lens_world, tag.world_tag);
      if (dot(rotate(lens_tag.rotation, Vec3d{0, 0, 1}), lens_tag.translation) >= 0) continue;
      TagObservation seen;
      seen.lens = static_cast<int>(l);
      seen.tag.family = tag.family;
      seen.tag.id = tag.id;
      bool whole = true;
      const auto corners = tag_corners(tag.size_m);
      for (std::size_t k = 0; k < 4; ++k) {
        const Vec3d p = transformed(lens_tag, corners[k]);
        const auto pixel = model.project(p);
        whole = whole && pixel && angle_between(p, Vec3d{0, 0, 1}) < model.max_angle_rad() - 0.03;
        if (!pixel) continue;
        seen.tag.corners[k] = {pixel->x + sigma_px * normal(random), pixel->y + sigma_px * normal(random)};
        const double variance = sigma_px > 0 ? sigma_px * sigma_px : 1e-4;
        seen.tag.covariance[k] = {variance, 0, variance};
      }
      if (whole) out.push_back(seen);
    }
  }
  return out;
}

/// Error of an estimated pose, parametrised as in UncertainPose: rotation vector (rad) and translation (m), world
/// frame.
inline std::array<double, 6> error_of(const Pose& estimate, const Pose& truth) {
  const Quat q = estimate.rotation * truth.rotation.inverse();
  const double s = q.w < 0 ? -2 : 2;
  const Vec3d t = estimate.translation - truth.translation;
  return {s * q.x, s * q.y, s * q.z, t.x, t.y, t.z};
}

}  // namespace lightwell::test
