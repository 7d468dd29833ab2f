// Batch irradiance against the single query, on every SIMD target that this machine supports.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <lightwell/cap.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/query.hpp>

#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Normals over the sphere with lengths from 0.5 to 2; their number is not a multiple of any vector length.
std::vector<Vec3f> normals_all_over(int count) {
  std::vector<Vec3f> out;
  for (int i = 0; i < count; ++i)
    out.push_back(vec_cast<float>(fibonacci_direction(i, count)) *
                  (0.5F + 1.5F * static_cast<float>(i) / static_cast<float>(count)));
  return out;
}

Descriptor scene_of(int band, float radius) {
  Descriptor d = test::constant_scene({3, 2, 1});
  d.radiance.band = band;
  for (int i = 1; i < sh_count(band); ++i) {
    const float v = std::sin(static_cast<float>(i));
    d.radiance.c[static_cast<std::size_t>(i)] = {v, 0.5F * v, -v};
  }
  if (radius >= 0)
    d.lights = {test::light({0.2F, 0.9F, -0.3F}, {8, 7, 6}, radius, 1),
                test::light({-1, 0, 0}, {2, 3, 4}, 2 * radius, 2)};
  return d;
}

/// Scalar reference from the definitions in query.hpp.
float largest_difference(const Descriptor& d, std::span<const Vec3f> normals, std::span<const Irradiance> found) {
  float largest = 0, difference = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Irradiance e = irradiance_at(d, normalized(normals[i]));
    for (int c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(e[c]));
      difference = std::max(difference, std::abs(e[c] - found[i][c]));
    }
  }
  return difference / largest;
}

/// Selects each target in turn, and finally the best one again.
class EveryTarget : public testing::TestWithParam<std::int64_t> {
 public:
  EveryTarget() { hwy::SetSupportedTargetsForTest(GetParam()); }
  ~EveryTarget() override { hwy::SetSupportedTargetsForTest(0); }
};
INSTANTIATE_TEST_SUITE_P(, EveryTarget, testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& each) { return std::string(hwy::TargetName(each.param)); });

TEST_P(EveryTarget, BatchMatchesSingleNormals) {
  const std::vector<Vec3f> normals = normals_all_over(1003);
  std::vector<Irradiance> found(normals.size());
  for (int band = 0; band <= kMaxBand; ++band) {
    // No lights, point lights, the sun, windows, and half the sky.
    for (const float radius : {-1.0F, 0.0F, 0.0047F, 0.3F, 0.78F}) {
      const Descriptor d = scene_of(band, radius);
      const auto answer = Lighting::of(d).irradiance(normals, found);
      EXPECT_EQ(answer.value, 0U);
      EXPECT_EQ(answer.validity, Validity::valid);
      // Tolerance: sums of 49 float terms in another order.
      EXPECT_LT(largest_difference(d, normals, found), 1e-5) << "band " << band << ", radius " << radius;
    }
  }
}

TEST_P(EveryTarget, BatchMatchesSingleNormalsForASunAtTheHorizon) {
  const Descriptor d = test::one_light({1, 0, 0}, {1, 1, 1}, 0.0047F);
  std::vector<Vec3f> normals;
  for (int i = 0; i <= 200; ++i) {
    const float t = 0.01F * static_cast<float>(i - 100) * 0.01F;
    normals.push_back({std::sin(t), std::cos(t), 0});
  }
  std::vector<Irradiance> found(normals.size());
  (void)Lighting::of(d).irradiance(normals, found);
  for (std::size_t i = 0; i < normals.size(); ++i) EXPECT_NEAR(found[i].r, irradiance_at(d, normals[i]).r, 1e-7) << i;
}

TEST_P(EveryTarget, CountsInvalidNormalsAndEvaluatesTheOthers) {
  std::vector<Vec3f> normals = normals_all_over(64);
  normals[3] = {};
  normals[17] = {kNan, 0, 1};
  normals[18] = {0, kInf, 0};
  normals[63] = {0, 0, -0.0F};
  normals[40] = normals[40] * 1e-25F;
  normals[41] = normals[41] * 1e25F;
  normals[42] = {0, std::numeric_limits<float>::denorm_min(), 0};
  const Lighting lighting = Lighting::of(scene_of(2, 0.1F));
  std::vector<Irradiance> found(normals.size(), {7, 7, 7});
  const auto answer = lighting.irradiance(normals, found);
  EXPECT_EQ(answer.value, 4U);
  EXPECT_EQ(answer.validity, Validity::invalid_query);
  for (const std::size_t none : {3, 17, 18, 63}) EXPECT_EQ(found[none], Irradiance{});
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Answer<Irradiance> one = lighting.irradiance(normals[i]);
    EXPECT_EQ(one.validity == Validity::invalid_query, i == 3 || i == 17 || i == 18 || i == 63) << i;
    EXPECT_NEAR(found[i].g, one.value.g, 2e-4) << i;
  }
}

TEST(ManyNormals, EmptyLightingIsZeroAndSpansMustMatch) {
  const std::vector<Vec3f> normals = normals_all_over(10);
  std::vector<Irradiance> found(10, {7, 7, 7});
  EXPECT_EQ(Lighting().irradiance(normals, found).validity, Validity::none);
  EXPECT_EQ(found, std::vector<Irradiance>(10));
  std::vector<Irradiance> too_few(9, {7, 7, 7});
  EXPECT_EQ(Lighting::of(scene_of(2, 0)).irradiance(normals, too_few).validity, Validity::invalid_query);
  EXPECT_EQ(too_few, std::vector<Irradiance>(9, {7, 7, 7}));
  EXPECT_EQ(Lighting::of(scene_of(2, 0)).irradiance(std::span<const Vec3f>(), std::span<Irradiance>()).validity,
            Validity::valid);
}

}  // namespace
}  // namespace lightwell
