// The glossy plane against closed forms, a quadrature over half vectors, single rays by hand.
#include "reference/glossy_plane.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "reference/glossy_sequence.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

constexpr double kRadian = pi / 180;

V3 towards(double elevation_deg, double azimuth_deg) {
  const double e = elevation_deg * kRadian, a = azimuth_deg * kRadian;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

/// The integral of f_s n.l, over half vectors drawn from D n.h: with xi = 1 / (1 + tan^2 / alpha^2) uniform in 0..1 it
/// is the mean of F G2 v.h / (n.v n.h), which grows as 1 / sqrt(xi): hence xi = s^2. G2 = 1 / (1 + Lambda(v) +
/// Lambda(l)), Lambda = (-1 + sqrt(1 + alpha^2 tan^2)) / 2.
double directional_albedo(const Gloss& gloss, const V3& v, int steps = 400) {
  const auto lambda = [&](double z) {
    const double tan2 = 1 / (z * z) - 1;
    return 0.5 * (std::sqrt(1 + gloss.alpha * gloss.alpha * tan2) - 1);
  };
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double s = (i + 0.5) / steps, theta = std::atan(gloss.alpha * std::sqrt(1 / (s * s) - 1));
    for (int k = 0; k < steps; ++k) {
      const double phi = 2 * pi * (k + 0.5) / steps;
      const V3 h{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
      const double v_dot_h = dot(v, h);
      const V3 l = 2 * v_dot_h * h - v;
      if (v_dot_h <= 0 || l.z <= 0) continue;
      sum += 2 * s * fresnel(gloss, v_dot_h) / (1 + lambda(v.z) + lambda(l.z)) * v_dot_h / (v.z * h.z);
    }
  }
  return sum / (steps * steps);
}

TEST(GlossyPlane, FramesAreTurnedByAQuarter) {
  EXPECT_LT(distance(plane_from_world({1, 0, 0}), {1, 0, 0}), rounding);
  EXPECT_LT(distance(plane_from_world({0, 0, -1}), {0, 1, 0}), rounding);
  EXPECT_LT(distance(plane_from_world({0, 1, 0}), {0, 0, 1}), rounding);
  EXPECT_LT(distance(world_from_plane(plane_from_world({1, 2, 3})), {1, 2, 3}), rounding);
}

TEST(GlossyPlane, FresnelTermsByHand) {
  EXPECT_EQ(fresnel({0.1, FresnelTerm::kOne}, 0.3), 1);
  EXPECT_NEAR(fresnel({0.1, FresnelTerm::kSchlick}, 1), 0.04, rounding);
  EXPECT_NEAR(fresnel({0.1, FresnelTerm::kSchlick}, 0.5), 0.04 + 0.96 / 32, rounding);
  EXPECT_NEAR(fresnel({0.1, FresnelTerm::kSchlick}, 0), 1, rounding);
  const Gloss glass{0.1, FresnelTerm::kDielectric, 0, 1.5};
  EXPECT_NEAR(fresnel(glass, 1), 0.04, rounding);
  EXPECT_NEAR(fresnel(glass, 0), 1, rounding);
  // At Brewster's angle tan i = 1.5 only the perpendicular component is left: ((n^2 - 1) / (n^2 + 1))^2 / 2.
  EXPECT_NEAR(fresnel(glass, std::cos(std::atan(1.5))), 0.5 * std::pow(1.25 / 3.25, 2), rounding);
}

TEST(GlossyPlane, BrdfIsReciprocalAndEndsAtTheHorizon) {
  SplitMix random(1);
  for (int k = 0; k < 100; ++k) {
    const V3 v = towards(random.uniform(1, 90), random.uniform(0, 360));
    const V3 l = towards(random.uniform(1, 90), random.uniform(0, 360));
    const Gloss gloss{random.uniform(0.02, 1)};
    const double there = gloss_brdf(gloss, v, l);
    EXPECT_NEAR(there / gloss_brdf(gloss, l, v), 1, rounding);
    EXPECT_EQ(gloss_brdf(gloss, v, {l.x, l.y, -l.z}), 0);
    EXPECT_EQ(gloss_brdf(gloss, {v.x, v.y, -v.z}, l), 0);
  }
}

TEST(GlossyPlane, ConstantEnvironmentGivesTheDirectionalAlbedo) {
  const Panorama env = constant(128, 64, {2, 2, 2});
  for (const FresnelTerm term : {FresnelTerm::kOne, FresnelTerm::kSchlick, FresnelTerm::kDielectric}) {
    for (const double alpha : {0.1, 0.3, 1.0}) {
      for (const double elevation : {15.0, 40.0, 90.0}) {
        const Gloss gloss{alpha, term};
        const V3 v = towards(elevation, 70);
        // Cells of 0.35 degrees, in lobes of at least 2 alpha tan 15 degrees = 3 degrees: (0.35 / 3)^2 / 24 = 6e-4.
        EXPECT_NEAR(specular_radiance(env, v, gloss, 8)[0] / (2 * directional_albedo(gloss, v)), 1, 1e-3)
            << alpha << " " << elevation;
      }
    }
  }
}

TEST(GlossyPlane, ReflectsNoMoreThanArrives) {
  for (const double alpha : {0.03, 0.1, 0.2, 0.5, 1.0}) {
    for (const double elevation : {1.0, 5.0, 20.0, 60.0, 90.0}) {
      // 1e-3 for the quadrature.
      EXPECT_LE(directional_albedo({alpha, FresnelTerm::kOne}, towards(elevation, 0), 300), 1.001);
    }
  }
  EXPECT_GT(directional_albedo({0.03, FresnelTerm::kOne}, towards(90, 0)), 0.995);
}

TEST(GlossyPlane, FiniteAtGrazingAngles) {
  const Panorama env = constant(64, 32, {1, 1, 1});
  for (const double z : {1e-3, 1e-9, 1e-300}) {
    const Rgb s = specular_radiance(env, normalised({1, 0, z}), {0.1, FresnelTerm::kOne}, 2);
    EXPECT_TRUE(std::isfinite(s[0]) && s[0] > 0) << z;
  }
  EXPECT_EQ(specular_radiance(env, {1, 0, 0}, {}, 1)[0], 0);
  EXPECT_EQ(specular_radiance(env, {0, 0, -1}, {}, 1)[0], 0);
}

TEST(GlossyPlane, SmallLampIsSeenInTheMirrorDirection) {
  // A disc of 0.3 degrees in a lobe of 2 alpha = 3.4 degrees: its mean of (1 + u^2)^-2 is 0.4 % below the peak.
  const double rho = 0.3 * kRadian;
  const V3 l = towards(50, 30), mirrored = towards(50, 210);
  const Panorama env = disc_lamp(1024, 512, world_from_plane(l), rho, {100, 100, 100}, 16);
  const Gloss gloss{0.03};
  const double perpendicular = 100 * pi * std::sin(rho) * std::sin(rho);
  EXPECT_NEAR(specular_radiance(env, mirrored, gloss, 1)[1] / (gloss_brdf(gloss, mirrored, l) * perpendicular * l.z), 1,
              0.02);
  double largest = 0, at_elevation = 0, at_azimuth = 0;
  for (double d = -1; d < 1.01; d += 0.2) {
    const double s = specular_radiance(env, towards(50 + d, 210), gloss, 1)[1];
    if (s > largest) largest = s, at_elevation = d;
  }
  largest = 0;
  for (double d = -1; d < 1.01; d += 0.2) {
    const double s = specular_radiance(env, towards(50, 210 + d), gloss, 1)[1];
    if (s > largest) largest = s, at_azimuth = d;
  }
  EXPECT_LT(std::abs(at_elevation), 0.3);
  EXPECT_LT(std::abs(at_azimuth), 0.3);
}

TEST(GlossyPlane, IrradianceInClosedForm) {
  EXPECT_NEAR(plane_irradiance(constant(32, 16, {3, 3, 3}))[0], 3 * pi, rounding);
  EXPECT_NEAR(plane_irradiance(constant(33, 17, {3, 3, 3}))[0], 3 * pi, rounding);  // a row at the horizon
  const Panorama gradient = lamps_on_gradient(256, 128, {2, 2, 2}, {1, 1, 1}, {});
  // Midpoints of 128 rows.
  EXPECT_NEAR(plane_irradiance(gradient)[1], pi * 1.5 + 2 * pi / 3 * 0.5, 1e-3);
}

/// The largest difference of the table from the sum over pixels, as a fraction of the largest S.
double table_error(const Panorama& env, const Gloss& gloss, int samples_per_axis, int directions) {
  const SpecularTable table(env, gloss);
  SplitMix random(7);
  double largest = 0, worst = 0;
  for (int k = 0; k < 20000; ++k) {
    const V3 v = towards(random.uniform(8, 90), random.uniform(0, 360));
    largest = std::max(largest, table.radiance(v)[1]);
  }
  for (int k = 0; k < directions; ++k) {
    V3 v = towards(random.uniform(8, 90), random.uniform(0, 360));
    // Every other direction sees a lamp.
    while (k % 2 == 1 && table.radiance(v)[1] < 0.1 * largest) {
      v = towards(random.uniform(8, 90), random.uniform(0, 360));
    }
    const Rgb truth = specular_radiance(env, v, gloss, samples_per_axis), found = table.radiance(v);
    for (std::size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(found[c] - truth[c]));
  }
  return worst / largest;
}

TEST(SpecularTable, AgreesWithTheSumOverPixels) {
  const Panorama env = random_lamps(3, 96, 48, 6);
  EXPECT_LT(table_error(env, {0.06}, 8, 50), 0.003);
  EXPECT_LT(table_error(env, {0.2}, 4, 50), 0.003);
  EXPECT_LT(table_error(random_lamps(4, 65, 33, 4), {0.2}, 6, 20),
            0.003);  // half of the last row is below the horizon
}

TEST(SpecularTable, KeepsTheTailsOfTheLobe) {
  for (const double alpha : {0.06, 0.2}) {
    const Gloss gloss{alpha, FresnelTerm::kOne};
    const SpecularTable table(constant(64, 32, {1, 1, 1}), gloss);
    for (const double elevation : {10.0, 20.0, 50.0, 85.0}) {
      const V3 v = towards(elevation, 123);
      // Joined blocks leave 7e-4, the quadrature 5e-5. A lobe cut off at a slope of 10 alpha would lack 1e-2.
      EXPECT_NEAR(table.radiance(v)[0] / directional_albedo(gloss, v), 1, 8e-4) << alpha << " " << elevation;
    }
  }
  // A lamp far from the mirror direction, seen in the tail alone: relative to the tail.
  const Panorama lamp = disc_lamp(128, 64, world_from_plane(towards(30, 0)), 0.1, {1000, 1000, 1000});
  const Gloss gloss{0.06};
  const SpecularTable table(lamp, gloss);
  for (const V3& v : {towards(80, 10), towards(40, 90), towards(25, 350)}) {
    EXPECT_NEAR(table.radiance(v)[2] / specular_radiance(lamp, v, gloss, 2)[2], 1, 5e-3);
  }
}

/// Row 0 is 0.1, 0.2; row 1 is 0.3, 0.4; green and blue are double and triple.
PlaneTexture four_texels(bool nearest) {
  PlaneTexture t{2, {}, nearest};
  for (const double a : {0.1, 0.2, 0.3, 0.4}) t.rgb.insert(t.rgb.end(), {a, 2 * a, 3 * a});
  return t;
}

TEST(GlossyPlane, TextureByHand) {
  const PlaneTexture smooth = four_texels(false), nearest = four_texels(true);
  EXPECT_NEAR(albedo_at(smooth, 0.4, -0.1, 0.1)[0], 0.1, rounding);  // a texel's centre
  EXPECT_NEAR(albedo_at(smooth, 0.4, 0.1, -0.1)[1], 0.8, rounding);
  EXPECT_NEAR(albedo_at(smooth, 0.4, 0, 0)[2], 0.75, rounding);  // the mean of all
  EXPECT_NEAR(albedo_at(smooth, 0.4, -0.05, 0.1)[0], 0.125, rounding);
  EXPECT_NEAR(albedo_at(smooth, 0.4, -0.2, 0.2)[0], 0.1, rounding);  // clamped
  EXPECT_NEAR(albedo_at(smooth, 0.4, -0.2, -0.2)[0], 0.3, rounding);
  EXPECT_EQ(albedo_at(nearest, 0.4, -0.01, 0.01)[0], 0.1);
  EXPECT_EQ(albedo_at(nearest, 0.4, 0.01, 0.01)[0], 0.2);
  EXPECT_EQ(albedo_at(nearest, 0.4, 0.01, -0.01)[0], 0.4);
}

TEST(GlossyPlane, TheRightHalfMayBeMatte) {
  const Panorama env = random_lamps(5, 64, 32, 3);
  const SpecularTable table(env, {0.2});
  GlossyScene scene{plain_texture(2, {0, 0, 0}), 0.2, plane_irradiance(env), &table};
  scene.right_half = nullptr;
  const V3 v = normalised({0.3, 0.2, 0.8});
  EXPECT_EQ(radiance_towards(scene, -0.01, 0, v), table.radiance(v));
  EXPECT_EQ(radiance_towards(scene, 0.01, 0, v), Rgb{});
}

// The sum over the panorama with the BRDF in the frame of the tilted normal.
TEST(GlossyPlane, ACurledPageMirrorsByItsTiltedNormal) {
  const Panorama env = random_lamps(5, 256, 128, 3);
  const Gloss gloss{0.2};
  const SpecularTable table(env, gloss);
  GlossyScene scene{plain_texture(2, {0, 0, 0}), 0.2, plane_irradiance(env), &table};
  scene.curl = std::tan(3 * pi / 180);
  for (const double x : {-0.1, -0.03, 0.0, 0.1}) {
    const double tilt = std::atan(2 * scene.curl * x / scene.size_m);
    const V3 along{std::cos(tilt), 0, std::sin(tilt)}, normal{-std::sin(tilt), 0, std::cos(tilt)};
    const auto local = [&](const V3& d) { return V3{dot(d, along), d.y, dot(d, normal)}; };
    for (const V3& towards : {V3{0.3, 0.2, 0.8}, V3{-0.5, 0.4, 0.5}, V3{0, 0, 1}}) {
      const V3 v = normalised(towards);
      Rgb expected{};
      for (int j = 0; j < env.height; ++j)
        for (int i = 0; i < env.width; ++i) {
          const V3 l = local(plane_from_world(pixel_direction(i, j, env.width, env.height)));
          if (!(l.z > 0)) continue;
          const double weight = gloss_brdf(gloss, local(v), l) * l.z * pixel_solid_angle(j, env.width, env.height);
          for (std::size_t c = 0; c < 3; ++c) expected[c] += weight * pixel(env, i, j)[c];
        }
      const Rgb found = radiance_towards(scene, x, 0, v);
      // Fresnel's and Smith's terms change by up to 5 % over three degrees; light from below the plane's horizon is not
      // in the table.
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 0.06 * expected[c]) << x << " " << v.x;
    }
  }
}

TEST(GlossyPlane, ViewFromAboveByHand) {
  const Panorama env = random_lamps(5, 64, 32, 3);
  const SpecularTable table(env, {0.2});
  // Half a metre above the centre, looking down, image up is the plane's +Y: (x, y, z) -> (x, -y, 0.5 - z).
  const Pose pose{M3{V3{1, 0, 0}, V3{0, -1, 0}, V3{0, 0, -1}}, {0, 0, 0.5}};
  EXPECT_LT(distance(eye_of(pose), {0, 0, 0.5}), rounding);
  const GlossyScene scene{four_texels(false), 0.2, plane_irradiance(env), &table, {7, 8, 9}};
  const PinholeCamera camera{80, 60, 100, 39, 30};
  const GlossyView view = render_view(scene, camera, pose, 1);
  const auto at = [&](int x, int y, std::size_t c) { return view.rgb[3 * static_cast<std::size_t>(y * 80 + x) + c]; };
  // Ten pixels to the right and five down: 5 cm and 2.5 cm on the plane.
  const double x = 0.05, y = -0.025;
  const V3 v = normalised({-x, -y, 0.5});
  for (std::size_t c = 0; c < 3; ++c) {
    const double matte = albedo_at(scene.albedo, 0.2, x, y)[c] / pi * scene.irradiance[c];
    EXPECT_NEAR(at(49, 35, c), matte + table.radiance(v)[c], rounding);
    EXPECT_NEAR(radiance_towards(scene, x, y, v)[c], matte + table.radiance(v)[c], rounding);
    EXPECT_EQ(at(39, 0, c), scene.background[c]);
  }
  // The plane is 40 pixels wide: from 39 - 20 to 39 + 20, both borders through the middle of a pixel.
  const GlossyView fine = render_view(scene, camera, pose, 4);
  double area = 0;
  for (const double c : fine.coverage) area += c;
  EXPECT_NEAR(area, 1600, rounding);
  EXPECT_EQ(fine.coverage[30 * 80 + 19], 0.5);
  EXPECT_EQ(fine.coverage[30 * 80 + 20], 1);
  EXPECT_EQ(fine.coverage[30 * 80 + 18], 0);
  EXPECT_EQ(fine.coverage[50 * 80 + 59], 0.25);
  const std::size_t border = 3 * (30 * 80 + 19);
  EXPECT_GT(fine.rgb[border], 3.5);  // half of it is background
  // From below the plane is not seen.
  const Pose below{M3{V3{1, 0, 0}, V3{0, 1, 0}, V3{0, 0, 1}}, {0, 0, 0.5}};
  EXPECT_EQ(render_view(scene, camera, below, 2).coverage, std::vector<double>(80 * 60, 0.0));
}

TEST(GlossyPlane, SlantedViewAgreesWithSingleRays) {
  const Panorama env = random_lamps(6, 128, 64, 5);
  const SpecularTable table(env, {0.1});
  const GlossyScene scene{book_texture(2, 64), 0.25, plane_irradiance(env), &table, {}};
  const std::vector<Pose> poses = hand_held_trajectory(11, 300);
  for (const int frame : {0, 150, 299}) {
    const Pose& pose = poses[static_cast<std::size_t>(frame)];
    for (const auto& [x, y] : {V2{0.03, 0.01}, V2{-0.05, 0.04}, V2{0.01, -0.06}}) {
      // The principal point is chosen so that the point's image is the centre of pixel (3, 2).
      const V3 p_cv = rotated(pose.rotation, {x, y, 0}) + pose.translation;
      const PinholeCamera camera{8, 6, 500, 3 - 500 * p_cv.x / p_cv.z, 2 - 500 * p_cv.y / p_cv.z};
      const GlossyView view = render_view(scene, camera, pose, 1);
      const V3 v = normalised(eye_of(pose) - V3{x, y, 0});
      const Rgb truth = radiance_towards(scene, x, y, v);
      // Rounding of the point's position (1e-16 m), times texels per metre and the table's slope.
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(view.rgb[3 * (2 * 8 + 3) + c], truth[c], 1e-9 * truth[c]);
    }
    // One sample of S a pixel is enough: pixels of 0.002 rad, alpha 0.1, (0.02)^2 / 24 of the peak.
    const PinholeCamera camera{80, 60, 500, 39.5, 29.5};
    const GlossyView one = render_view(scene, camera, pose, 3), nine = render_view(scene, camera, pose, 3, 3);
    const double peak = *std::max_element(nine.rgb.begin(), nine.rgb.end());
    for (std::size_t k = 0; k < one.rgb.size(); ++k) EXPECT_NEAR(one.rgb[k], nine.rgb[k], 3e-5 * peak);
  }
}

}  // namespace
}  // namespace lightwell::reference
