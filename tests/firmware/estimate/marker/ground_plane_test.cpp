// The plane on which a body stands, at true poses of the shipped bodies, without images.
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/marker/shading.hpp"
#include "firmware/estimate/marker/shipped_bodies.hpp"

namespace lightwell::marker {
namespace {

using test::pinhole;
using test::shipped_body;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kDistance_m = 0.6;
const Vec3d kProbeUp{0, 1, 0};

Vec3d normal_of(const MarkerFace& face) { return rotate(face.body_face.rotation, Vec3d{0, 0, 1}); }

/// Pose of a body that stands on `face`, in the middle of the picture. `turn`: about the vertical.
Pose standing_on(const MarkerFace& face, double elevation_deg, double roll_deg, double turn) {
  const Vec3d down = normal_of(face), across = cross(down, -kProbeUp);
  Quat upright{0, 0, 0, 1};
  if (length(across) > 1e-9)
    upright = Quat::about(normalized(across), angle_between(down, -kProbeUp));
  else if (dot(down, kProbeUp) > 0)
    upright = Quat::about({1, 0, 0}, std::numbers::pi);
  return {Quat::about({0, 0, 1}, roll_deg * kDegree) * Quat::about({1, 0, 0}, elevation_deg * kDegree) *
              Quat::about(kProbeUp, turn) * upright,
          {0, 0, -kDistance_m}};
}

/// Share of 36 turns and all supporting faces for which the plane is that of the supporting face.
double share_found(const MarkerBody& body, double elevation_deg, double roll_deg) {
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  int found = 0, all = 0;
  for (const MarkerFace& face : body.faces)
    for (int k = 0; k < 36; ++k, ++all) {
      const PosedBody posed(body, lens, model, standing_on(face, elevation_deg, roll_deg, k * 10 * kDegree));
      const std::optional<GroundPlane> plane = posed.ground_plane(std::nullopt);
      found += plane && dot(plane->normal, -posed.normal_of(face)) > 0.999 ? 1 : 0;
    }
  return static_cast<double>(found) / all;
}

TEST(GroundPlane, IsTheTableForCamerasThatLookDown) {
  struct Case {
    std::string body;
    /// Smallest share at elevations of 10, 20, ... 60 degrees. Faces of an icosahedron are 41.8 degrees apart: at 10,
    /// 20 and 60 degrees another face is sometimes nearer to the mean elevation.
    std::array<double, 6> least;
  };
  for (const Case& one :
       {Case{"cube_60mm_grey", {1, 1, 1, 1, 1, 1}}, Case{"dodecahedron_100mm_white", {0.9, 1, 1, 1, 1, 1}},
        Case{"dodecahedron_100mm_grey", {0.9, 1, 1, 1, 1, 1}},
        Case{"icosahedron_100mm_white", {0.6, 0.8, 1, 1, 1, 0.7}}}) {
    const MarkerBody body = shipped_body(one.body);
    for (std::size_t k = 0; k < one.least.size(); ++k)
      for (const double roll_deg : {-8.0, 0.0, 8.0})
        EXPECT_GE(share_found(body, 10.0 * static_cast<double>(k + 1), roll_deg), one.least[k])
            << one.body << ", " << 10 * (k + 1) << " deg, roll " << roll_deg << " deg";
  }
}

/// The pose at which the body, as in `standing`, is seen `aside_deg` to the right of the axis, by a camera that is
/// level towards the body and then turned away from it.
Pose level_towards_the_body(const Pose& standing, double aside_deg) {
  const Pose turn{Quat::about({0, 1, 0}, -aside_deg * kDegree), {}};
  return compose(turn, standing);
}

/// The same by a camera whose image's horizontal axis is level. Seen from the body, its elevation is the same.
Pose level_in_itself(const MarkerFace& face, double elevation_deg, double aside_deg, double turn) {
  const double pitch = std::asin(std::sin(elevation_deg * kDegree) / std::cos(aside_deg * kDegree));
  const Vec3d ray{std::sin(aside_deg * kDegree), 0, -std::cos(aside_deg * kDegree)};
  Pose out = standing_on(face, pitch / kDegree, 0, turn);
  out.translation = ray * kDistance_m;
  return out;
}

TEST(GroundPlane, IsTheTableBesideTheAxisOfALevelCamera) {
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  for (const char* name : {"cube_60mm_grey", "dodecahedron_100mm_white", "icosahedron_100mm_white"}) {
    const MarkerBody body = shipped_body(name);
    for (const bool towards_body : {true, false})
      for (const double aside_deg : {-25.0, 25.0}) {
        int found = 0, all = 0;
        for (const MarkerFace& face : body.faces)
          for (int k = 0; k < 36; ++k, ++all) {
            const double turn = k * 10 * kDegree;
            const Pose pose = towards_body ? level_towards_the_body(standing_on(face, 50, 0, turn), aside_deg)
                                           : level_in_itself(face, 50, aside_deg, turn);
            const PosedBody posed(body, lens, model, pose);
            const MarkerFace* below = posed.face_below(std::nullopt);
            found += below == &face ? 1 : 0;
          }
        EXPECT_GE(found, 0.95 * all) << name << ", " << aside_deg << " deg, level towards the body: " << towards_body;
      }
  }
}

TEST(GroundPlane, IsTheSheetOfABall) {
  const MarkerBody body = shipped_body("ball_40mm");
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  const PosedBody posed(body, lens, model, {Quat::about({1, 0, 0}, 60 * kDegree), {0, 0, -kDistance_m}});
  const std::optional<GroundPlane> plane = posed.ground_plane(std::nullopt);
  ASSERT_TRUE(plane);
  EXPECT_GT(dot(plane->normal, posed.normal_of(body.faces[0])), 0.999);
}

TEST(GroundPlane, AKnownUpDecidesAlone) {
  const MarkerBody body = shipped_body("cube_60mm_grey");
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  const MarkerFace& support = body.faces.back();
  // The camera is upside down.
  const PosedBody posed(body, lens, model, standing_on(support, 60, 180, 0.2));
  EXPECT_EQ(posed.face_below(-posed.normal_of(support)), &support);
  EXPECT_NE(posed.face_below(std::nullopt), &support);
  // On a corner: 54.7 degrees from the normals of three faces, more than the limit of 50.
  const Vec3d corner =
      normalized(posed.normal_of(body.faces[0]) + posed.normal_of(body.faces[1]) + posed.normal_of(body.faces[2]));
  EXPECT_EQ(posed.face_below(corner), nullptr);
  EXPECT_EQ(posed.face_below(-corner), nullptr);
}

TEST(GroundPlane, IsAbsentWhereNoFaceIsLikely) {
  // One face, which stands upright and faces the camera.
  MarkerBody body = shipped_body("cube_60mm_grey");
  body.faces.resize(2);
  body.faces.erase(body.faces.begin());
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  const PosedBody posed(body, lens, model, {Quat{0, 0, 0, 1}, {0, 0, -kDistance_m}});
  EXPECT_EQ(posed.face_below(std::nullopt), nullptr);
  EXPECT_FALSE(posed.ground_plane(std::nullopt));
}

}  // namespace
}  // namespace lightwell::marker
