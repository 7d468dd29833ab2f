// Photometric stereo, and depth refined by its normals.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/relight_capture.hpp>

#include "host_sdk/relight/wall_scene.hpp"

namespace lightwell::test {
namespace {

/// A wavy wall in 60 x 40 pixels of 1 cm at about 2 m, under lights around the camera.
struct WavyScene {
  RelightCamera camera{60, 40, 200, 30, 20, {}};
  Albedo albedo{0.5F, 0.4F, 0.3F};
  std::vector<float> depth;
  std::vector<Vec3f> normals;
  std::vector<BasisLight> basis;
  std::vector<std::vector<Radiance>> photographs;

  WavyScene() {
    for (int i = 0; i < 12; ++i) {
      const double angle = 2 * std::numbers::pi * i / 12, tilt = i % 2 == 0 ? 0.5 : 1.2;
      basis.push_back({Vec3d{tilt * std::cos(angle), tilt * std::sin(angle), 0.2}, LightDistance::finite, {9, 6, 3}});
    }
    photographs.assign(basis.size(), std::vector<Radiance>(camera.pixels()));
    for (std::size_t p = 0; p < camera.pixels(); ++p) {
      const double x = (static_cast<double>(p % 60) + 0.5 - 30) / 200,
                   y = -(static_cast<double>(p / 60) + 0.5 - 20) / 200;
      // z = -2 + 0.01 sin(40 X), as a fixed point along the ray.
      double z = -2;
      for (int i = 0; i < 20; ++i) z = -2 + 0.01 * std::sin(40 * x * -z);
      depth.push_back(static_cast<float>(-z));
      const Vec3d at{-x * z, -y * z, z}, normal = normalized(Vec3d{-0.4 * std::cos(40 * at.x), 0, 1});
      normals.push_back(vec_cast<float>(normal));
      for (std::size_t i = 0; i < basis.size(); ++i) {
        const Vec3d to = basis[i].place - at;
        const auto e = static_cast<float>(std::max(0.0, dot(normal, to)) / (length(to) * dot(to, to)));
        photographs[i][p] = reflected_radiance(basis[i].irradiance * e, albedo);
      }
    }
  }
  [[nodiscard]] RelightSubject subject() const { return RelightSubject::from_depth(camera, depth, {}).value(); }
};

/// The photographs are direct light alone.
constexpr PhotometricStereoOptions kDirect{0, {}};

double worst_angle(const WavyScene& scene, const PhotometricSurface& surface) {
  double worst = 0;
  for (std::size_t p = 0; p < scene.normals.size(); ++p)
    worst = std::max(worst, static_cast<double>(angle_between(scene.normals[p], surface.normals[p])));
  return worst;
}

TEST(EstimateSurface, MatteSurface) {
  const WavyScene scene;
  const auto surface = estimate_surface(scene.subject(), scene.basis, spans_of(scene.photographs), kDirect);
  ASSERT_TRUE(surface.ok()) << surface.status().message();
  EXPECT_EQ(surface->without_answer, 0U);
  // Photographs are exact: what is left is the precision of float.
  EXPECT_LT(worst_angle(scene, *surface), 1e-3);
  for (const Albedo& a : surface->albedo) {
    EXPECT_NEAR(a.r, 0.5, 1e-3);
    EXPECT_NEAR(a.b, 0.3, 1e-3);
  }
}

TEST(EstimateSurface, ShadowsAndHighlights) {
  WavyScene scene;
  // A quarter of the lights is shadowed in one pixel, and one has a highlight of three times the white.
  for (std::size_t p = 0; p < scene.depth.size(); ++p) {
    for (std::size_t k = 0; k < 3; ++k) scene.photographs[(p + 4 * k) % 12][p] = {};
    scene.photographs[(p + 2) % 12][p] += Radiance{2, 2, 2};
  }
  const auto surface = estimate_surface(scene.subject(), scene.basis, spans_of(scene.photographs), kDirect);
  ASSERT_TRUE(surface.ok());
  EXPECT_EQ(surface->without_answer, 0U);
  // Weights of outliers are small, not 0.
  EXPECT_LT(worst_angle(scene, *surface), 0.03);
}

TEST(EstimateSurface, InterreflectionsAreSubtracted) {
  // A right-angled fold: each side shines on the other, so that the photographs are too bright.
  WallScene scene;
  scene.albedo = {0.8F, 0.8F, 0.8F};
  std::vector<float> depth(scene.camera.pixels());
  for (std::size_t p = 0; p < depth.size(); ++p)
    depth[p] = static_cast<float>(3 / (1 + std::abs(static_cast<double>(p % 40) + 0.5 - 20) / 40));
  const auto subject = RelightSubject::from_depth(scene.camera, depth, {scene.albedos(), {}});
  ASSERT_TRUE(subject.ok());
  for (const Vec3d& place :
       {Vec3d{-0.5, 0.5, 0}, Vec3d{0.5, 0.5, 0}, Vec3d{0, -0.7, 0}, Vec3d{0, 0, 0.5}, Vec3d{0.2, 0.9, 0}})
    scene.basis.push_back({place, LightDistance::finite, {9, 9, 9}});
  // Photographs with the library's own indirect light: I_existing of each light.
  const std::vector<RgbFactor> white(4, RgbFactor{1, 1, 1});
  std::vector<PatternLight> patterns;
  for (const BasisLight& light : scene.basis) {
    patterns.push_back(pattern_at(light.place, 2, 2, white));
    patterns.back().field_of_view_rad = 2.5;
  }
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(*subject, scene.basis, patterns, {}).ok());
  IndirectOptions options;
  options.surface_reflectance = 0;
  const auto indirect = simulate_indirect(*subject, scene.basis, {}, alpha, options);
  ASSERT_TRUE(indirect.ok());
  std::vector<std::vector<Radiance>> photographs;
  for (std::size_t i = 0; i < scene.basis.size(); ++i) {
    photographs.push_back(indirect->existing[i]);
    for (std::size_t p = 0; p < depth.size(); ++p) {
      const double tangent = (static_cast<double>(p % 40) + 0.5 - 20) / 40;
      const Vec3d at =
          Vec3d{tangent, -(static_cast<double>(p / 40) + 0.5 - 15) / 40, -1} * static_cast<double>(depth[p]);
      const Vec3d normal = vec_cast<double>(subject->normals()[p]), to = scene.basis[i].place - at;
      const auto e = static_cast<float>(std::max(0.0, dot(normal, to)) / (length(to) * dot(to, to)));
      photographs[i][p] += reflected_radiance(scene.basis[i].irradiance * e, scene.albedo);
    }
  }
  const std::size_t near_fold = 15 * 40 + 22;
  const auto error = [&](int rounds) {
    PhotometricStereoOptions stereo;
    stereo.interreflection_rounds = rounds;
    stereo.indirect = options;
    const auto surface = estimate_surface(*subject, scene.basis, spans_of(photographs), stereo);
    EXPECT_TRUE(surface.ok());
    return std::abs(static_cast<double>(surface->albedo[near_fold].g) - 0.8);
  };
  const double without = error(0), with = error(2);
  EXPECT_GT(without, 0.01);
  EXPECT_LT(with, 0.4 * without);
}

TEST(EstimateSurface, PixelsWithoutAnswer) {
  WavyScene scene;
  scene.depth[0] = 0;
  for (auto& photograph : scene.photographs) photograph[1] = {};
  for (std::size_t i = 2; i < scene.photographs.size(); ++i) scene.photographs[i][2] = {};
  scene.photographs[5][3].r = std::numeric_limits<float>::quiet_NaN();
  const auto surface = estimate_surface(scene.subject(), scene.basis, spans_of(scene.photographs));
  ASSERT_TRUE(surface.ok());
  EXPECT_EQ(surface->without_answer, 2U);
  for (const std::size_t p : {0, 1}) EXPECT_EQ(surface->normals[p], Vec3f{});
  // Two lights are not enough: the normal of the geometry.
  EXPECT_LT(angle_between(surface->normals[2], scene.normals[2]), 0.1F);
  EXPECT_TRUE(is_finite(surface->normals[3]) && std::isfinite(surface->albedo[3].r));
  EXPECT_FALSE(estimate_surface(scene.subject(), scene.basis, {}).ok());
  EXPECT_FALSE(estimate_surface(scene.subject(), {}, {}).ok());
}

TEST(RefineDepth, NormalsRemoveNoise) {
  const WavyScene scene;
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.004F);
  std::vector<float> noisy = scene.depth;
  for (float& d : noisy) d += noise(random);
  const auto subject = RelightSubject::from_depth(scene.camera, noisy, {});
  ASSERT_TRUE(subject.ok());
  const auto refined = refine_depth(*subject, scene.normals);
  ASSERT_TRUE(refined.ok()) << refined.status().message();
  const auto rms = [&](const std::vector<float>& depth) {
    double squares = 0;
    for (std::size_t p = 0; p < depth.size(); ++p)
      squares += std::pow(static_cast<double>(depth[p] - scene.depth[p]), 2);
    return std::sqrt(squares / static_cast<double>(depth.size()));
  };
  // Each depth becomes the mean of about a dozen, as the weights say; and the mean is kept.
  EXPECT_LT(rms(*refined), 0.45 * rms(noisy));
}

TEST(RefineDepth, ExactDepthStays) {
  const WavyScene scene;
  const auto refined = refine_depth(scene.subject(), scene.normals);
  ASSERT_TRUE(refined.ok());
  // Steps of a pixel of a wave of 16 pixels: second-order differences.
  for (std::size_t p = 0; p < refined->size(); ++p) EXPECT_NEAR((*refined)[p], scene.depth[p], 1e-3);
}

TEST(RefineDepth, HolesAndBadInput) {
  WavyScene scene;
  scene.depth[100] = 0;
  scene.normals[101] = {};
  const auto refined = refine_depth(scene.subject(), scene.normals);
  ASSERT_TRUE(refined.ok());
  EXPECT_EQ((*refined)[100], 0);
  EXPECT_NEAR((*refined)[101], scene.depth[101], 2e-3);
  EXPECT_FALSE(refine_depth(scene.subject(), {}).ok());
  EXPECT_FALSE(refine_depth(scene.subject(), scene.normals, {0, 8}).ok());
  EXPECT_FALSE(refine_depth(scene.subject(), scene.normals, {0.1, 0}).ok());
  scene.normals[5].y = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(refine_depth(scene.subject(), scene.normals).ok());
  const auto nothing = RelightSubject::from_depth(scene.camera, std::vector<float>(scene.camera.pixels()), {});
  ASSERT_TRUE(nothing.ok());
  EXPECT_TRUE(refine_depth(*nothing, std::vector<Vec3f>(scene.camera.pixels())).ok());
}

}  // namespace
}  // namespace lightwell::test
