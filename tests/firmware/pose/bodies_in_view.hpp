// A dodecahedron in front of an ordinary camera, and what an ideal detector would see of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/pose/mounting_room.hpp"
#include "pose/body_pose.hpp"
#include "pose/marker_bodies.hpp"

namespace lightwell::test {

inline MarkerBody dodecahedron() {
  Result<MarkerBody> body = make_dodecahedron();
  EXPECT_TRUE(body) << body.status().message();
  return std::move(*body);
}

/// One pinhole camera; 60 degrees across.
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

/// Where the body's outline is `width_px` wide in the middle of the picture: a dodecahedron is about 1.31 of its size.
inline double distance_for(double width_px, double focal_px = 1100) { return 0.131 * focal_px / width_px; }

inline Pose body_at(Vec3d place, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return {Quat{normal(random), normal(random), normal(random), normal(random)}.normalized(), place};
}

/// Turned so that the tag of face 0 looks `tilt_rad` past the camera, and few or no others are seen.
inline Pose face_on(double distance_m, double tilt_rad) {
  // Face 0 looks along the body's +Y; the camera is towards +Z of the probe's axes.
  return {(Quat::about({0, 1, 0}, tilt_rad) * Quat::about({1, 0, 0}, kPi / 2)).normalized(), {0, 0, -distance_m}};
}

/// Tags turned less than 72 degrees away, corners off by `sigma_px` in each coordinate.
inline std::vector<TagObservation> seen_of(const RigParameters& rig, const MarkerBody& body, const Pose& probe_body,
                                    double sigma_px, std::uint64_t seed) {
  const auto tags = tags_of(body);
  EXPECT_TRUE(tags);
  auto seen = seen_from(rig, *tags, inverse(probe_body), sigma_px, seed);
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

inline double turn_of(const std::array<double, 6>& e) { return std::hypot(e[0], e[1], e[2]); }
inline double shift_of(const std::array<double, 6>& e) { return std::hypot(e[3], e[4], e[5]); }

}  // namespace lightwell::test
