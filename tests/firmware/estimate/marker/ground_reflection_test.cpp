// Irradiance of a face by light that the table reflects, compared with closed forms for a uniform disc: the integral of
// cos cos / (pi r^2) over it.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {
namespace {

constexpr double kHeight = 0.05, kRadius = 0.3, kStep = 0.005;
constexpr Rgb kRadiance = {0.2, 0.4, 0.1};
/// Relative error by the approximation of the disc by squares.
constexpr double kSquares = 0.01;

/// A face `kHeight` above the middle of a uniform disc with normal `up`, in a black plane that is sampled to twice the
/// disc's radius. Samples nearer to the middle than `hidden` (m) are missing.
Shading above_a_disc(Vec3d up, Vec3d normal, double hidden = 0) {
  Shading out;
  SurfaceSample face;
  face.normal = normal;
  face.irradiance = {1, 1, 1};
  face.sigma = {0.01, 0.01, 0.01};
  out.samples = {face};
  GroundPlane& ground = out.ground.emplace();
  ground.normal = up;
  ground.point = up * -kHeight;
  ground.step_m = kStep;
  const auto [u, v] = tangent_basis(up);
  const int across = static_cast<int>(2 * kRadius / kStep);
  for (int x = -across; x <= across; ++x)
    for (int y = -across; y <= across; ++y) {
      const double off = kStep * std::hypot(x, y);
      if (off > 2 * kRadius || off < hidden) continue;
      GroundSample sample;
      sample.position = ground.point + u * (x * kStep) + v * (y * kStep);
      if (off <= kRadius) sample.color = kRadiance;
      ground.samples.push_back(sample);
    }
  return out;
}

Rgb from_ground(Shading shading) {
  estimate_ground_reflection(shading);
  return shading.samples[0].from_ground;
}

TEST(GroundReflection, FaceThatPointsDownReceivesTheDisc) {
  const double factor = kRadius * kRadius / (kRadius * kRadius + kHeight * kHeight);
  for (const Vec3d up : {Vec3d{0, 1, 0}, normalized(Vec3d{0.2, 0.9, -0.3}), Vec3d{0, 0, 1}}) {
    const Rgb light = from_ground(above_a_disc(up, -up));
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(light[c] / (std::numbers::pi * kRadiance[c] * factor), 1, kSquares) << c;
  }
}

TEST(GroundReflection, VerticalFaceReceivesHalfOfTheDisc) {
  const double h = kHeight / kRadius;
  const double factor = (std::atan(1 / h) - h / (h * h + 1)) / std::numbers::pi;
  const Vec3d up{0, 1, 0};
  const Rgb light = from_ground(above_a_disc(up, {0, 0, 1}));
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(light[c] / (std::numbers::pi * kRadiance[c] * factor), 1, 2 * kSquares) << c;
}

TEST(GroundReflection, FaceThatPointsUpReceivesNothing) {
  EXPECT_EQ(from_ground(above_a_disc({0, 1, 0}, {0, 1, 0})), Rgb{});
}

TEST(GroundReflection, ThePlaneContinuesBeyondItsSamples) {
  for (const Vec3d normal : {Vec3d{0, -1, 0}, Vec3d{0, 0, 1}, normalized(Vec3d{1, 1, 0}), Vec3d{0, 1, 0}}) {
    Shading shading = above_a_disc({0, 1, 0}, normal);
    for (GroundSample& sample : shading.ground->samples) sample.color = kRadiance;
    const Rgb light = from_ground(shading);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(light[c], std::numbers::pi * kRadiance[c] * (1 - normal.y) / 2, 1e-9) << c;
  }
}

TEST(GroundReflection, HiddenPatchesGetTheRadianceOfTheNearestSamples) {
  const Vec3d up{0, 1, 0};
  const Rgb whole = from_ground(above_a_disc(up, -up)), partly = from_ground(above_a_disc(up, -up, 0.07));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(partly[c], whole[c], 1e-9) << c;
}

TEST(GroundReflection, ThePlaneContinuesAsBrightAsOnItsSide) {
  // Half of the plane is bright, and sampled to twice the height of the face. A vertical face above the border sees the
  // half before it, to infinity: pi L / 2.
  Shading shading = above_a_disc({0, 1, 0}, {1, 0, 0});
  std::erase_if(shading.ground->samples,
                [](const GroundSample& s) { return std::hypot(s.position.x, s.position.z) > 2 * kHeight; });
  for (GroundSample& s : shading.ground->samples) s.color = s.position.x > 0 ? kRadiance : Rgb{};
  const double half = std::numbers::pi * kRadiance[0] / 2;
  // The disc alone gives 0.45 of it, and a rest as bright as the mean of both halves 0.73.
  EXPECT_NEAR(from_ground(shading)[0] / half, 0.85, 0.05);
  shading.samples[0].normal = {-1, 0, 0};
  EXPECT_NEAR(from_ground(shading)[0] / half, 0.15, 0.05);
}

TEST(GroundReflection, IsSubtractedWithItsUncertainty) {
  Shading shading = above_a_disc({0, 1, 0}, {0, -1, 0});
  estimate_ground_reflection(shading);
  const Rgb light = shading.samples[0].from_ground;
  subtract_ground_reflection(shading);
  const SurfaceSample& face = shading.samples[0];
  EXPECT_NEAR(face.irradiance[0], 1 - light[0], 1e-12);
  EXPECT_EQ(face.irradiance[1], 0) << "the difference is clamped to 0";
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(face.sigma[c], std::hypot(0.01, 0.2 * light[c]), 1e-12) << c;
  EXPECT_EQ(face.from_ground, Rgb{}) << "a second call must subtract nothing";
}

TEST(GroundReflection, WithoutGroundPlaneIsZero) {
  Shading shading = above_a_disc({0, 1, 0}, {0, -1, 0});
  shading.ground->samples.clear();
  estimate_ground_reflection(shading);
  EXPECT_EQ(shading.samples[0].from_ground, Rgb{});
  shading.ground.reset();
  estimate_ground_reflection(shading);
  subtract_ground_reflection(shading);
  EXPECT_EQ(shading.samples[0].irradiance, (Rgb{1, 1, 1}));
}

}  // namespace
}  // namespace lightwell::marker
