// Simulated tag observations of a dodecahedron in front of a pinhole camera.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/pose/mounting_room.hpp"
#include "pose/body_tracker.hpp"
#include "pose/marker_bodies.hpp"

namespace lightwell::test {

inline MarkerBody dodecahedron() {
  Result<MarkerBody> body = make_dodecahedron();
  EXPECT_TRUE(body) << body.status().message();
  return std::move(*body);
}

/// Standard deviations of a folded and glued body's faces from their places, about and along each of their axes.
struct BuildErrors {
  double turn_rad = 0, shift_m = 0;
};

inline MarkerBody with_build_errors(MarkerBody body, const BuildErrors& errors, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto drawn = [&] { return Vec3d{normal(random), normal(random), normal(random)}; };
  for (MarkerFace& face : body.faces) {
    const Vec3d turn = drawn() * errors.turn_rad, shift = drawn() * errors.shift_m;
    const double angle = length(turn);
    const Quat rotation = angle > 0 ? Quat::about(turn * (1 / angle), angle) : Quat{};
    face.body_face = compose(face.body_face, Pose{rotation, shift});
    face.body_face.rotation = face.body_face.rotation.normalized();
  }
  return body;
}

/// One pinhole camera with a horizontal field of view of 60 degrees.
inline RigParameters camera_rig(int width = 1280, int height = 960, double focal_px = 1100) {
  LensParameters lens;
  lens.width = width;
  lens.height = height;
  MeiParameters mei;
  mei.fx = mei.fy = focal_px;
  mei.cx = (width - 1) / 2.0;
  mei.cy = (height - 1) / 2.0;
  lens.model = mei;
  lens.max_angle_rad = std::atan(0.51 * std::hypot(width, height) / focal_px) + 0.1;
  lens.pose_cv.rotation = upright_lens_cv();
  RigParameters rig;
  rig.lenses = {lens};
  return rig;
}

/// Distance at which the body's outline is `width_px` wide, m: the outline of a dodecahedron is about 1.31 times
/// size_m.
inline double distance_for(double width_px, double focal_px = 1100) { return 0.131 * focal_px / width_px; }

/// A random attitude at `place`.
inline Pose body_at(Vec3d place, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return {Quat{normal(random), normal(random), normal(random), normal(random)}.normalized(), place};
}

/// Face 0 towards the camera, tilted by `tilt_rad`, so that few or no other tags are visible.
inline Pose face_on(double distance_m, double tilt_rad) {
  // The normal of face 0 is the body's +Y; seen from the body, the camera is towards +Z of the probe frame.
  return {(Quat::about({0, 1, 0}, tilt_rad) * Quat::about({1, 0, 0}, kPi / 2)).normalized(), {0, 0, -distance_m}};
}

/// Observations of the tags whose normal is within 72 degrees of the direction to the lens, with Gaussian corner noise
/// of `sigma_px` in each coordinate.
inline std::vector<TagObservation> simulate_body_observations(const RigParameters& rig, const MarkerBody& body,
                                                              const Pose& probe_body, double sigma_px,
                                                              std::uint64_t seed) {
  const auto tags = tags_of(body);
  EXPECT_TRUE(tags);
  auto seen = simulate_observations(rig, *tags, inverse(probe_body), sigma_px, seed);
  std::erase_if(seen, [&](const TagObservation& s) {
    for (const WorldTag& tag : *tags) {
      const Pose probe_face = compose(probe_body, tag.world_tag);
      const Vec3d lens = rig.lenses[static_cast<std::size_t>(s.lens)].pose_cv.translation;
      if (tag.id == s.tag.id)
        return angle_between(rotate(probe_face.rotation, Vec3d{0, 0, 1}), lens - probe_face.translation) > 72 * kDegree;
    }
    return true;
  });
  return seen;
}

/// Norms of the rotation (rad) and translation (m) parts of error_of().
inline double turn_of(const std::array<double, 6>& e) { return std::hypot(e[0], e[1], e[2]); }
inline double shift_of(const std::array<double, 6>& e) { return std::hypot(e[3], e[4], e[5]); }

}  // namespace lightwell::test
