// The light that a captured plane reflects onto objects, against closed forms and a quadrature in double.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include <lightwell/plane_light.hpp>

#include "host_sdk/plane_light_quadrature.hpp"
#include "host_sdk/reflection_scenes.hpp"
#include "host_sdk/shadow_scenes.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSide = kSquareSide_m;

/// D and S are uniform. RGB9E5 holds these values exactly.
CapturedPlane uniform_plane(Radiance diffuse, Radiance specular) {
  CapturedPlane out = linear_plane();
  std::ranges::fill(out.texture.radiance, diffuse);
  std::ranges::fill(out.lumisphere.radiance, specular);
  return out;
}

PlaneLight light_of(const CapturedPlane& plane, ImageRecipients images = ImageRecipients::all_clients) {
  PlaneLight out;
  out.update(received_plane(plane, images));
  return out;
}

/// Form factor of a rectangle with a corner below a receiver that faces down (Howell, "A Catalog of Radiation Heat
/// Transfer Configuration Factors", B-4).
double corner_form_factor(double a, double b, double height) {
  const double x = a / height, y = b / height, p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * kPi);
}

/// Of the square from a receiver above the point (x, y), by four corners with signs.
double form_factor(double x, double y, double height) {
  const double h = kSide / 2;
  double sum = 0;
  for (const double a : {h - x, h + x})
    for (const double b : {h - y, h + y})
      sum += std::copysign(1.0, a * b) * corner_form_factor(std::abs(a), std::abs(b), height);
  return sum;
}

TEST(PlaneLight, OfAUniformSquareIsTheFormFactor) {
  const PlaneLight light = light_of(uniform_plane({0.5, 1, 2}, {}));
  for (const Vec3d point : {Vec3d{0, 0, 0.1}, {0.03, -0.07, 0.02}, {0.2, 0.05, 0.04}, {0, 0.3, 1}, {0.05, 0, 1e-4}}) {
    const PlaneLightAnswer answer = light.irradiance(point, {0, 0, -3});
    const double factor = form_factor(point.x, point.y, point.z);
    ASSERT_EQ(answer.validity, Validity::valid);
    EXPECT_EQ(answer.source, PlaneLightSource::texture);
    // Floats of the answer.
    EXPECT_NEAR(answer.value.r, 0.5 * kPi * factor, 1e-6) << point.x;
    EXPECT_NEAR(answer.value.b, 2 * kPi * factor, 4e-6) << point.x;
  }
}

TEST(PlaneLight, APartOfTheSquareBelowTheHorizonDoesNotCount) {
  const PlaneLight light = light_of(uniform_plane({1, 1, 1}, {}));
  for (const Vec3d normal : {Vec3d{1, 0, 0}, {0.6, 0, -0.8}, {0, -0.8, 0.6}, {0.48, 0.6, -0.64}})
    for (const Vec3d point : {Vec3d{0, 0, 0.05}, {-0.08, 0.02, 0.1}}) {
      const double expected = square_irradiance(point, normal, [](Vec3d, Vec3d) { return 1.0; });
      // The midpoint rule at the horizon.
      EXPECT_NEAR(light.irradiance(point, normal).value.g, expected, 1e-4) << normal.x << " " << point.x;
    }
  EXPECT_EQ(light.irradiance({0, 0, 0.1}, {0, 0, 1}).value.g, 0) << "faces away";
}

TEST(PlaneLight, OfATextureAgreesWithTheQuadrature) {
  const CapturedPlane plane = plane_with_patch(64);
  const PlaneLight light = light_of(plane);
  const auto radiance = [&](Vec3d at, Vec3d) { return texel_green(plane, at); };
  for (const Vec3d normal : {Vec3d{0, 0, -1}, {1, 0, 0}, {-0.6, 0.48, -0.64}})
    for (const Vec3d point : {Vec3d{0, 0, 0.1}, {0.03, 0.03, 0.01}, {-0.15, 0, 0.03}, {0, 0.3, 0.5}}) {
      const double expected = square_irradiance(point, normal, radiance, 640);
      const PlaneLightAnswer answer = light.irradiance(point, normal, PlaneLayers::diffuse);
      // kTileTolerance times pi times the mean radiance 0.5 for each of some tens of tiles, which cancel in part.
      EXPECT_NEAR(answer.value.g, expected, 0.01 * std::max(expected, 0.3)) << normal.x << " " << point.x;
    }
}

TEST(PlaneLight, OfTheMirrorImageAgreesWithTheQuadrature) {
  const PlaneLight light = light_of(linear_plane());
  const auto specular = [](Vec3d, Vec3d to_viewer) { return double{linear_specular(std::acos(to_viewer.z)).r}; };
  for (const Vec3d normal : {Vec3d{0, 0, -1}, {0.8, 0, -0.6}})
    for (const Vec3d point : {Vec3d{0, 0, 0.1}, {0.04, 0.03, 0.02}, {-0.02, 0, 0.2}}) {
      const double expected = square_irradiance(point, normal, specular);
      // 545 beams; the edge of the square cuts some of them.
      EXPECT_NEAR(light.irradiance(point, normal, PlaneLayers::specular).value.r, expected, 0.06 * expected + 0.004);
    }
  // Both parts add up.
  const Vec3d point{0, 0, 0.05}, down{0, 0, -1};
  EXPECT_NEAR(light.irradiance(point, down).value.g,
              light.irradiance(point, down, PlaneLayers::diffuse).value.g +
                  light.irradiance(point, down, PlaneLayers::specular).value.g,
              1e-6);
}

TEST(PlaneLight, AHighlightGoesInItsDirection) {
  // One direction of S is bright: the plane sends it to points above the square along that direction only.
  CapturedPlane plane = uniform_plane({}, {});
  const std::size_t node = plane.lumisphere.grid.nearest({0.6F, 0, 0.8F});
  plane.lumisphere.radiance[node] = {64, 64, 64};
  const PlaneLight light = light_of(plane);
  const double flux = 64 * plane.lumisphere.grid.solid_angle(node);
  const Vec3d towards = plane.lumisphere.grid.direction(node);
  // At a node, S between nodes falls linearly to 0: its integral is the node's solid angle within 10 %.
  EXPECT_NEAR(light.irradiance(towards * 0.06, -towards).value.g, flux, 0.1 * flux);
  EXPECT_EQ(light.irradiance({-0.2, 0, 0.06}, -towards).value.g, 0);
}

TEST(PlaneLight, TheSquareMayBeTurnedScaledAndMoved) {
  CapturedPlane plane = linear_plane();
  const PlaneLight straight = light_of(plane);
  plane.info.texture_to_plane = {0.01, -0.02, 0.7, 1.5};
  const PlaneLight moved = light_of(plane);
  const Vec3d point{0.03, 0.02, 0.04}, normal = normalized(Vec3d{0.3, 0.5, -0.6});
  const PlanePoint at = plane.info.texture_to_plane.plane_point({point.x, point.y});
  const Vec3d turned = rotate(Quat::about({0, 0, 1}, 0.7), normal);
  const Irradiance a = straight.irradiance(point, normal, PlaneLayers::diffuse).value;
  const Irradiance b = moved.irradiance({at.x, at.y, 1.5 * point.z}, turned, PlaneLayers::diffuse).value;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-5);
  EXPECT_GT(a.r, 0.1F);
}

TEST(PlaneLight, ReplacesTheLightingInTheDirectionsOfTheSquare) {
  const Lighting lighting = lighting_of({}, {0.5, 0.5, 0.5}, {});
  const Vec3d point{0.02, 0.01, 0.05};
  const PlaneLight same = light_of(uniform_plane({0.5, 0.5, 0.5}, {})), dark = light_of(uniform_plane({}, {}));
  for (const Vec3d normal : {Vec3d{0, 0, -1}, {0.8, 0, -0.6}, {0, 0, 1}}) {
    const double factor = square_irradiance(point, normal, [](Vec3d, Vec3d) { return 1.0; }) / kPi;
    const PlaneLightAnswer answer = same.irradiance(point, normal, lighting);
    EXPECT_EQ(answer.validity, Validity::valid);
    // The rounding of floats, and of the midpoint rule.
    EXPECT_NEAR(answer.value.g, 0.5 * kPi, 1e-4) << "as bright as the rest";
    EXPECT_NEAR(dark.irradiance(point, normal, lighting).value.g, 0.5 * kPi * (1 - factor), 1e-4);
  }
}

TEST(PlaneLight, HidesLightsBelowTheSquare) {
  const Lighting lighting = lighting_of({{{0.1, 0, -1}, 0, {3, 3, 3}}, {{0, 0, 1}, 0, {1, 1, 1}}}, {}, {});
  const PlaneLight dark = light_of(uniform_plane({}, {}));
  EXPECT_NEAR(dark.irradiance({0, 0, 0.05}, {0, 0, -1}, lighting).value.g, 0, 1e-6);
  EXPECT_NEAR(dark.irradiance({0, 0, 0.05}, {0, 0, 1}, lighting).value.g, 1, 1e-5);
  EXPECT_NEAR(dark.irradiance({0.5, 0, 0.05}, {0, 0, -1}, lighting).value.g, 3 / std::sqrt(1.01), 1e-4);
}

TEST(PlaneLight, WithoutATextureTheLightingIsUsedAndTheAnswerSaysSo) {
  const PlaneLight light = light_of(uniform_plane({1, 1, 1}, {}), ImageRecipients::nobody);
  const Lighting lighting = lighting_of({}, {0.5, 0.5, 0.5}, {});
  const PlaneLightAnswer alone = light.irradiance({0, 0, 0.1}, {0, 0, -1});
  EXPECT_EQ(alone.validity, Validity::none);
  EXPECT_EQ(alone.source, PlaneLightSource::none);
  EXPECT_EQ(alone.value, Irradiance{});
  const PlaneLightAnswer with = light.irradiance({0, 0, 0.1}, {0, 0, -1}, lighting);
  EXPECT_EQ(with.validity, Validity::valid);
  EXPECT_EQ(with.source, PlaneLightSource::descriptor);
  EXPECT_NEAR(with.value.g, 0.5 * kPi, 1e-5);
  EXPECT_EQ(light.irradiance({0, 0, 0.1}, {0, 0, -1}, Lighting()).validity, Validity::none);
  EXPECT_EQ(PlaneLight().irradiance({0, 0, 0.1}, {0, 0, -1}).validity, Validity::none);
}

TEST(PlaneLight, UnseenTexelsCountAsTheMeanOfTheOthers) {
  CapturedPlane plane = uniform_plane({0.5, 1, 2}, {});
  const Irradiance whole = light_of(plane).irradiance({0, 0, 0.1}, {0, 0, -1}).value;
  for (std::size_t k = 0; k < plane.texture.count(); k += 3) {
    plane.texture.state[k] = SampleState::unseen;
    plane.texture.radiance[k] = {};
  }
  const PlaneLightAnswer answer = light_of(plane).irradiance({0, 0, 0.1}, {0, 0, -1});
  EXPECT_TRUE(answer.flags.has(PlaneFlag::unseen_texel));
  EXPECT_NEAR(answer.value.g, whole.g, 1e-5);
}

TEST(PlaneLight, TheEdgeOfATextureNeedBeNoPowerOfTwo) {
  CapturedPlane plane = linear_plane(37);
  std::ranges::fill(plane.lumisphere.radiance, Radiance{});
  const PlaneLight light = light_of(plane);
  const auto radiance = [](Vec3d at, Vec3d) { return double{linear_diffuse(at.x, at.y).b}; };
  for (const Vec3d point : {Vec3d{0, 0, 0.1}, {0.06, -0.05, 0.03}})
    // Texels of 5 mm are uniform: half a percent of the difference across the square.
    EXPECT_NEAR(light.irradiance(point, {0, 0, -1}).value.b, square_irradiance(point, {0, 0, -1}, radiance), 0.006);
}

TEST(PlaneLight, ExtremePointsGiveNumbers) {
  const PlaneLight light = light_of(linear_plane());
  const Lighting lighting = lighting_of({{{0.1, 0, -1}, 0.1, {3, 3, 3}}}, {0.5, 0.5, 0.5}, {});
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const Vec3d down{0, 0, -1};
  for (const auto& [point, normal] : {std::pair{Vec3d{0, 0, -0.01}, down},
                                      {Vec3d{nan, 0, 1}, down},
                                      {Vec3d{0, 0, inf}, down},
                                      {Vec3d{0, 0, 1}, Vec3d{}},
                                      {Vec3d{0, 0, 1}, {0, nan, 1}}}) {
    EXPECT_EQ(light.irradiance(point, normal).validity, Validity::invalid_query);
    EXPECT_EQ(light.irradiance(point, normal, lighting).validity, Validity::invalid_query);
    EXPECT_EQ(light.irradiance(point, normal).value, Irradiance{});
  }
  for (const Vec3d point : {Vec3d{0, 0, 0}, {0.1, 0.1, 0}, {0.1, 0, 1e-300}, {1e300, 0, 1e300}, {1e-9, 1e-9, 1e9}})
    for (const Vec3d normal : {down, Vec3d{1, 0, 0}, {1e-300, 0, -1e-300}, {0, 1e300, 0}})
      for (const PlaneLightAnswer& answer :
           {light.irradiance(point, normal), light.irradiance(point, normal, lighting)})
        for (int c = 0; c < 3; ++c) {
          EXPECT_GE(answer.value[c], 0);
          EXPECT_LT(answer.value[c], 100);
        }
  // On the square, from which all directions below come.
  const PlaneAnswer below = received_plane(linear_plane()).diffuse({0.03, 0.02});
  EXPECT_NEAR(light.irradiance({0.03, 0.02, 0}, down, PlaneLayers::diffuse).value.r, kPi * below.value.r, 0.02);
}

}  // namespace
}  // namespace lightwell::test
