// Evaluation of environment maps, and application of changes.
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/environment.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell {
namespace {

using Scene = std::function<float(Vec3f)>;

EnvironmentMap map_of(std::vector<EnvironmentLevel> levels, const std::function<float(Vec3f, std::size_t)>& scene) {
  EnvironmentMap map;
  map.levels = std::move(levels);
  for (std::size_t k = 0; k < map.levels.size(); ++k)
    for (int j = 0; j < map.levels[k].edge; ++j)
      for (int i = 0; i < map.levels[k].edge; ++i) {
        const float v = scene(texel_direction(map.levels[k].edge, i, j), k);
        map.texels.push_back(rgb9e5_encode(v, v / 2, v / 4));
      }
  map.key = environment_key(map);
  return map;
}

std::vector<Vec3f> directions() {
  std::vector<Vec3f> out;
  for (int i = 0; i < 3000; ++i) {
    const Vec3d d = fibonacci_direction(i, 3000);
    out.push_back(vec_cast<float>(Vec3d{d.x, d.z, d.y}));
  }
  for (const float v : {-1.0F, 1.0F}) {
    out.push_back({v, 0, 0});
    out.push_back({0, v, 0});
    out.push_back({0, 0, v});
  }
  return out;
}

TEST(Environment, ConstantMapGivesConstantRadiance) {
  const EnvironmentMap map = map_of({{16, 0}, {8, 1}}, [](Vec3f, std::size_t) { return 3.0F; });
  for (const Vec3f d : directions())
    for (const float r : {0.0F, 0.3F, 1.0F}) EXPECT_FLOAT_EQ(environment_radiance(map, d, r).r, 3) << d.x << " " << d.y;
}

TEST(Environment, InterpolatesASmoothSceneAcrossEdgesAndCorners) {
  // Bilinear between centres h apart, up to 4.7/edge rad: h²/8 of the second derivatives, which sum to twice the slope;
  // where the octahedron is bent, at its edges, an eighth of the change of slope times h; half a step of nine bits.
  const auto scene = [](Vec3f d) { return 2 + d.x + 0.5F * d.y - 0.7F * d.z; };
  for (const int edge : {8, 16, 32, 64}) {
    const EnvironmentMap map = map_of({{edge, 0}}, [&](Vec3f d, std::size_t) { return scene(d); });
    const double h = 4.7 / edge;
    for (const Vec3f d : directions())
      EXPECT_NEAR(environment_radiance(map, d, 0).r, scene(d), (h * h / 4 + h / 8) * 1.4 + 4.0 / 512)
          << edge << ": " << d.x << " " << d.y << " " << d.z;
  }
}

TEST(Environment, IsContinuousAcrossTheSeams) {
  std::mt19937 random(1);
  const EnvironmentMap map = map_of({{8, 0}}, [&](Vec3f, std::size_t) { return static_cast<float>(random() % 1000); });
  // Pairs of directions on both sides of the square's border: z = 0 or x = 0 below the horizon.
  for (int k = 0; k < 400; ++k) {
    const float a = -3.1415926F * static_cast<float>(k) / 400;  // From +X over -Y to -X.
    const float c = std::cos(a), s = std::sin(a), e = 1e-5F;
    EXPECT_NEAR(environment_radiance(map, {c, s, e}, 0).r, environment_radiance(map, {c, s, -e}, 0).r, 1) << k;
    EXPECT_NEAR(environment_radiance(map, {e, s, c}, 0).r, environment_radiance(map, {-e, s, c}, 0).r, 1) << k;
  }
}

TEST(Environment, InterpolatesLinearlyBetweenLevelsAndClamps) {
  const EnvironmentMap map = map_of({{16, 0.25F}, {8, 0.5F}, {8, 1}}, [](Vec3f, std::size_t k) {
    return k == 0 ? 1.0F : k == 1 ? 2.0F : 4.0F;
  });
  const auto at = [&](float r) { return environment_radiance(map, {0.3F, -0.8F, 0.1F}, r).r; };
  EXPECT_FLOAT_EQ(at(0), 1);
  EXPECT_FLOAT_EQ(at(0.25F), 1);
  EXPECT_FLOAT_EQ(at(0.375F), 1.5F);
  EXPECT_FLOAT_EQ(at(0.5F), 2);
  EXPECT_FLOAT_EQ(at(0.75F), 3);
  EXPECT_FLOAT_EQ(at(1), 4);
  EXPECT_FLOAT_EQ(at(7), 4);
  EXPECT_FLOAT_EQ(at(std::numeric_limits<float>::quiet_NaN()), 4);
}

TEST(Environment, InvalidInputGivesZero) {
  const EnvironmentMap map = map_of({{8, 0}}, [](Vec3f, std::size_t) { return 1.0F; });
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const Vec3f d : {Vec3f{}, Vec3f{nan, 0, 1}, Vec3f{0, inf, 0}})
    EXPECT_EQ(environment_radiance(map, d, 0), Radiance{});
  EXPECT_EQ(environment_radiance({}, {0, 1, 0}, 0), Radiance{});
}

TEST(Environment, ScalesByTheExponent) {
  EnvironmentMap map = map_of({{8, 0}}, [](Vec3f, std::size_t) { return 1.0F; });
  for (const int e : {kMinEnvironmentExponent, -27, 27, kMaxEnvironmentExponent}) {
    map.exponent = e;
    EXPECT_FLOAT_EQ(environment_radiance(map, {1, 2, 3}, 0).r, static_cast<float>(std::ldexp(1.0, e)));
  }
}

TEST(EnvironmentKey, DependsOnEveryPartOfTheContent) {
  const EnvironmentMap map = map_of({{16, 0}, {8, 1}}, [](Vec3f d, std::size_t) { return 2 + d.x; });
  EnvironmentMap other = map;
  other.exponent = 1;
  EXPECT_NE(environment_key(other), map.key);
  other = map;
  other.levels[1].roughness = 0.5F;
  EXPECT_NE(environment_key(other), map.key);
  for (std::size_t k = 0; k < map.texels.size(); ++k) {
    other = map;
    other.texels[k] ^= 1U << (k % 32);
    EXPECT_NE(environment_key(other), map.key);
  }
  other = map;
  other.key_interval_ms = 77;  // The interval is not part of the content.
  EXPECT_EQ(environment_key(other), map.key);
}

TEST(EnvironmentChanges, AreAppliedToTheirMapOnly) {
  const EnvironmentMap map = map_of({{8, 0}}, [](Vec3f d, std::size_t) { return 2 + d.x; });
  EnvironmentMap out;
  EnvironmentMap none;
  none.key = map.key;
  ASSERT_TRUE(apply_changes(map, none, out));
  EXPECT_EQ(out, map);
  EnvironmentMap some = none;
  some.runs = {0, 1, 61, 2};
  some.texels = {1, 2, 3};
  ASSERT_TRUE(apply_changes(map, some, out));
  for (std::size_t k = 0; k < 64; ++k)
    EXPECT_EQ(out.texels[k], k == 0 ? 1U : k == 62 ? 2U : k == 63 ? 3U : map.texels[k]);

  const EnvironmentMap before = out;
  const auto refused = [&](auto&& spoil) {
    EnvironmentMap bad = some;
    spoil(bad);
    return !apply_changes(map, bad, out) && out == before;
  };
  EXPECT_TRUE(refused([](EnvironmentMap& m) { ++m.key; }));
  EXPECT_TRUE(refused([](EnvironmentMap& m) { m.runs[2] = 62; }));
  EXPECT_TRUE(refused([](EnvironmentMap& m) { m.texels.pop_back(); }));
  EXPECT_TRUE(refused([&](EnvironmentMap& m) { m = map; }));
  EXPECT_FALSE(apply_changes(some, some, out)) << "changes of changes";
}

}  // namespace
}  // namespace lightwell
