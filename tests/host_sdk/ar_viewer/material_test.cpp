// Materials against their formulas in double.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/cap.hpp>
#include <lightwell/lobes.hpp>

#include "host_sdk/ar_viewer/viewer_scenes.hpp"

namespace lightwell::test {
namespace {

constexpr double kRadius = 0.1, kPi = std::numbers::pi;
constexpr Vec3d kCentre{0, kRadius, 0};
const Vec3d kLamp = normalized(Vec3d{0.4, 0.9, 0.7});

viewer::Material nothing() {
  viewer::Material m;
  m.lambert = 0;
  return m;
}

Vec3d mirrored(Vec3d d, Vec3d n) { return d - n * (2 * dot(d, n)); }

/// The sphere under one point light of irradiance 1 from kLamp, or in uniform radiance 1, compared with
/// expected(normal, to_eye) of the red channel. Reports the largest error relative to the largest value.
double largest_error(const viewer::Material& material, const Descriptor& light, double margin,
                     const std::function<double(Vec3d, Vec3d)>& expected) {
  viewer::Scene scene = make_viewer_scene();
  scene.objects = {make_object("sphere", {2 * kRadius})};
  scene.objects[0].material = material;
  set_light(scene, light);
  const Rendered picture = render(scene);
  double worst = 0, largest = 0;
  for_sphere_pixels(scene, kCentre, kRadius, margin, [&](int column, int row, Vec3d point, Vec3d normal) {
    // Near the terminator the shadow of a faceted sphere on itself begins.
    if (!light.lights.empty() && std::abs(dot(normal, kLamp)) < 0.2) return;
    const double value = expected(normal, normalized(eye_of(scene) - point));
    worst = std::max(worst, std::abs(static_cast<double>(picture.frame.at(column, row)[0]) - value));
    largest = std::max(largest, value);
  });
  EXPECT_GT(largest, 0);
  return worst / largest;
}

Descriptor one_lamp(double radius_deg = 0) {
  Descriptor d = uniform_light({0, 0, 0});
  d.lights = {make_light(vec_cast<float>(kLamp), {1, 1, 1}, radius_deg)};
  return d;
}

TEST(ViewerMaterial, BlinnPhongIsItsFormula) {
  viewer::Material m = nothing();
  m.blinn_phong = 0.7F;
  m.shininess = 20;
  const double error = largest_error(m, one_lamp(), 0.03, [](Vec3d n, Vec3d eye) {
    const double nh = std::max(dot(n, normalized(kLamp + eye)), 0.0);
    return 0.7 * 28 / (8 * kPi) * std::pow(nh, 20) * std::max(dot(n, kLamp), 0.0);
  });
  // Facets turn normals by up to 0.3 degrees, and the exponent multiplies that.
  EXPECT_LT(error, 0.03);
}

TEST(ViewerMaterial, AnisotropicHighlightIsThatOfAshikhminAndShirley) {
  viewer::Material m = nothing();
  m.anisotropic = 1;
  m.n_u = 4;
  m.n_v = 60;
  m.metallic = 1;
  m.base_color = {0.9F, 0.5F, 0.5F};
  const double error = largest_error(m, one_lamp(), 0.06, [](Vec3d n, Vec3d eye) {
    if (dot(n, kLamp) <= 0) return 0.0;
    // The sphere's u runs around +Y.
    const Vec3d u = normalized(Vec3d{n.z, 0, -n.x}), v = cross(n, u), h = normalized(kLamp + eye);
    const double nh = dot(n, h), kh = dot(eye, h);
    const double exponent = (4 * dot(h, u) * dot(h, u) + 60 * dot(h, v) * dot(h, v)) / (1 - nh * nh);
    const double fresnel = 0.9 + 0.1 * std::pow(1 - kh, 5);
    return std::sqrt(5.0 * 61) / (8 * kPi) * std::pow(nh, exponent) / (kh * std::max(dot(n, kLamp), dot(n, eye))) *
           fresnel * dot(n, kLamp);
  });
  EXPECT_LT(error, 0.06);
}

TEST(ViewerMaterial, GlassInUniformLightDividesItByFresnelsFactor) {
  viewer::Material m = nothing();
  m.reflection = m.refraction = m.fresnel = 1;
  m.ior = 1.5F;
  m.base_color = {0.5F, 0.5F, 0.5F};
  const double error = largest_error(m, uniform_light({1, 1, 1}), 0.05, [](Vec3d n, Vec3d eye) {
    const double f = 0.04 + 0.96 * std::pow(1 - dot(n, eye), 5);
    return f + 0.5 * (1 - f);
  });
  EXPECT_LT(error, 0.02);
}

TEST(ViewerMaterial, GlassShowsTheRefractedDirection) {
  viewer::Material m = nothing();
  m.refraction = 1;
  m.ior = 1.5F;
  m.base_color = {1, 1, 1};
  // Radiance 1 + x / 2 in the direction (x, y, z): a band that the reconstruction keeps.
  Descriptor d = uniform_light({1, 1, 1});
  d.radiance.band = 1;
  d.radiance.c[3] = Radiance{1, 1, 1} * (0.5F / 0.488603F);
  const Lighting lighting = Lighting::of(d);
  const double error = largest_error(m, d, 0.05, [&](Vec3d n, Vec3d eye) {
    const double eta = 1 / 1.5, c = dot(n, eye), k = 1 - eta * eta * (1 - c * c);
    const Vec3d refracted = eye * -eta + n * (eta * c - std::sqrt(k));
    return static_cast<double>(lighting.radiance(vec_cast<float>(refracted), 0).value.r);
  });
  EXPECT_LT(error, 0.01);
}

TEST(ViewerMaterial, RoughReflectionOfALampIsItsMeanUnderTheGgxLobe) {
  viewer::Material m = nothing();
  m.reflection = 1;
  for (const auto& [roughness, radius_deg] : {std::pair{0.3, 0.5}, std::pair{0.5, 4.0}, std::pair{0.6, 12.0}}) {
    m.roughness = static_cast<float>(roughness);
    const GgxLobe lobe(roughness);
    const double radius = radius_deg * kPi / 180;
    const double error = largest_error(m, one_lamp(radius_deg), 0.05, [&](Vec3d n, Vec3d eye) {
      if (dot(n, kLamp) < 0) return 0.0;
      return cap_radiance(dot(mirrored(-eye, n), kLamp), radius, lobe);
    });
    // The mean cosine over the cap stands for the cosine within the lobe.
    EXPECT_LT(error, 0.03) << roughness << ", " << radius_deg;
  }
}

/// Reflectance of a GGX surface of F0 in uniform radiance 1, by quadrature over the directions of light.
double ggx_albedo(double nv, double roughness, double f0) {
  const double alpha2 = std::pow(roughness, 4);
  const Vec3d eye{std::sqrt(1 - nv * nv), 0, nv};
  const auto smith = [&](double c) { return std::sqrt(alpha2 + (1 - alpha2) * c * c); };
  double sum = 0;
  constexpr int kDirections = 200000;
  for (int i = 0; i < kDirections / 2; ++i) {
    const Vec3d light = fibonacci_direction(i, kDirections);  // The first half is above z = 0.
    const Vec3d h = normalized(light + eye);
    const double d = alpha2 / (kPi * std::pow(1 + (alpha2 - 1) * h.z * h.z, 2));
    const double g = 0.5 / (light.z * smith(nv) + nv * smith(light.z));
    sum += d * g * (f0 + (1 - f0) * std::pow(1 - dot(eye, h), 5)) * light.z;
  }
  return sum * 4 * kPi / kDirections;
}

TEST(ViewerMaterial, MetalRoughInUniformLightHasTheAlbedoOfGgx) {
  for (const double roughness : {0.4, 0.7, 1.0}) {
    viewer::Material m = nothing();
    m.metal_rough = m.metallic = 1;
    m.base_color = {0.9F, 0.9F, 0.9F};
    m.roughness = static_cast<float>(roughness);
    viewer::Scene scene = make_viewer_scene();
    scene.objects = {make_object("sphere", {2 * kRadius})};
    scene.objects[0].material = m;
    set_light(scene, uniform_light({1, 1, 1}));
    const Rendered picture = render(scene);
    int number = 0;
    for_sphere_pixels(scene, kCentre, kRadius, 0.05, [&](int column, int row, Vec3d point, Vec3d normal) {
      if (++number % 997 != 0) return;
      // The table has 32 entries each way, of 256 samples.
      const double nv = dot(normal, normalized(eye_of(scene) - point));
      EXPECT_NEAR(picture.frame.at(column, row)[0], ggx_albedo(nv, roughness, static_cast<double>(0.9F)), 0.02)
          << roughness << ", " << nv;
    });
    EXPECT_GT(number, 10000);
  }
}

TEST(ViewerMaterial, VertexLightingIsFragmentLightingWhereLightIsSmooth) {
  viewer::Scene scene = make_viewer_scene();
  scene.objects = {make_object("sphere", {2 * kRadius})};
  Descriptor d = uniform_light({0.5F, 0.6F, 0.7F});
  d.radiance.band = 2;
  d.radiance.c[1] = {0.3F, 0.2F, 0.1F};
  set_light(scene, d);
  const Rendered fragment = render(scene);
  scene.objects[0].material.lighting = viewer::LightingRate::vertex;
  const Rendered vertex = render(scene);
  int differ = 0;
  for_sphere_pixels(scene, kCentre, kRadius, 0.02, [&](int column, int row, Vec3d, Vec3d) {
    ASSERT_NEAR(vertex.frame.at(column, row)[0], fragment.frame.at(column, row)[0], 0.005);
    differ += vertex.frame.at(column, row)[0] != fragment.frame.at(column, row)[0] ? 1 : 0;
  });
  EXPECT_GT(differ, 1000) << "interpolated";
}

TEST(ViewerMaterial, ANormalMapTurnsTheNormal) {
  viewer::Scene scene = make_viewer_scene();
  scene.objects = {make_object("box", {0.2, 0.02, 0.2})};
  Descriptor d = uniform_light({0, 0, 0});
  d.lights = {make_light({1, 1, 0}, {1, 1, 1}, 0)};
  set_light(scene, d);
  const PixelPoint p = pixel_of(scene, {0, 0.02, 0});
  const int column = static_cast<int>(p.column), row = static_cast<int>(p.row);
  const float flat = render(scene).frame.at(column, row)[0];
  // Red 204: x = 0.6, blue 230: z = 0.8. On top of the box the tangent is +X.
  viewer::Picture map;
  map.resize(2, 2);
  for (int i = 0; i < 4; ++i) {
    map.rgba[static_cast<std::size_t>(4 * i)] = viewer::srgb_linear(204);
    map.rgba[static_cast<std::size_t>(4 * i + 1)] = viewer::srgb_linear(128);
    map.rgba[static_cast<std::size_t>(4 * i + 2)] = viewer::srgb_linear(230);
  }
  const std::string path = testing::TempDir() + "/lightwell_normal_map.png";
  ASSERT_TRUE(viewer::write_png(path, map).ok());
  scene.objects[0].material.normal_map = path;
  const float turned = render(scene).frame.at(column, row)[0];
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(flat, 0.8 / kPi * half, 1e-3);
  EXPECT_NEAR(turned, 0.8 / kPi * (0.6 + 0.8) * half, 5e-3);
}

TEST(ViewerMaterial, AnObjectIsSeenInAMirrorBesideIt) {
  viewer::Material mirror = nothing();
  mirror.reflection = 1;
  viewer::Scene scene = make_viewer_scene();
  scene.objects = {make_object("sphere", {0.1}), make_object("sphere", {0.1}, {0.11, 0, 0})};
  scene.objects[0].material = mirror;
  scene.objects[1].material.base_color = {0.8F, 0, 0};
  set_light(scene, uniform_light({1, 1, 1}));
  const Rendered with = render(scene);
  scene.reflection.objects_edge = 0;
  const Rendered without = render(scene);
  // The mirror's point whose mirrored ray runs along +X, to the middle of the red ball.
  const Vec3d centre{0, 0.05, 0};
  const Vec3d normal = normalized(Vec3d{1, 0, 0} + normalized(eye_of(scene) - centre));
  const PixelPoint p = pixel_of(scene, centre + normal * 0.05);
  const int column = static_cast<int>(std::lround(p.column)), row = static_cast<int>(std::lround(p.row));
  EXPECT_NEAR(with.frame.at(column, row)[0], 0.8, 0.03);
  EXPECT_NEAR(with.frame.at(column, row)[1], 0.0, 0.03);
  EXPECT_NEAR(without.frame.at(column, row)[1], 1.0, 0.01);
}

}  // namespace
}  // namespace lightwell::test
