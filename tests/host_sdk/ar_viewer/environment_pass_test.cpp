// Levels of the cube map against environment_radiance() of the SDK, texel by texel.
#include "ar_viewer/environment_pass.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/cube_map.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/pixel.hpp>

#include "ar_viewer/headless_context.hpp"

namespace lightwell::test {
namespace {

using viewer::EnvironmentPass;
using viewer::HeadlessContext;

/// Each texel has a random colour.
EnvironmentMap random_map(std::vector<EnvironmentLevel> levels, int exponent) {
  EnvironmentMap map;
  map.levels = std::move(levels);
  map.exponent = exponent;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0.01F, 1);
  for (std::size_t k = 0; k < texel_count(map.levels); ++k)
    map.texels.push_back(rgb9e5_encode(value(random), value(random), value(random)));
  map.key = environment_key(map);
  return map;
}

/// RGBA of the six faces.
std::vector<float> drawn(const EnvironmentPass& pass, const EnvironmentMap& map, int edge, float roughness) {
  const viewer::GlTexture cube;
  glBindTexture(GL_TEXTURE_CUBE_MAP, cube.name());
  for (GLenum face = 0; face < 6; ++face)
    glTexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, 0, GL_RGBA32F, edge, edge, 0, GL_RGBA, GL_FLOAT, nullptr);
  viewer::set_sampling(GL_TEXTURE_CUBE_MAP, GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_EDGE);
  pass.draw(map, cube.name(), 0, edge, roughness);
  const std::size_t face_size = 4 * static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
  std::vector<float> texels(6 * face_size);
  for (GLenum face = 0; face < 6; ++face)
    glGetTexImage(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, 0, GL_RGBA, GL_FLOAT, texels.data() + face * face_size);
  return texels;
}

struct Case {
  std::vector<EnvironmentLevel> levels;
  int exponent = 0;
  viewer::EnvironmentScale scale;
};

class EnvironmentPassTest : public testing::TestWithParam<Case> {};

TEST_P(EnvironmentPassTest, DrawsTheRadianceOfTheSdkInTheAxesOfTheWorld) {
  const auto context = HeadlessContext::make();
  ASSERT_TRUE(context.ok()) << context.status().message();
  auto pass = EnvironmentPass::make();
  ASSERT_TRUE(pass.ok()) << pass.status().message();
  const EnvironmentMap map = random_map(GetParam().levels, GetParam().exponent);
  const Quat rotation = Quat::about(normalized(Vec3d{1, 2, 3}), 1.1);
  const viewer::EnvironmentScale scale = GetParam().scale;
  pass->upload({map, rotation, 1, {}, map}, scale);
  for (const float roughness : {0.0F, 0.21F, 0.5F, 0.8F, 1.0F})
    for (const int edge : {4, 32}) {
      const std::vector<float> texels = drawn(*pass, map, edge, roughness);
      const float* texel = texels.data();
      for (int face = 0; face < 6; ++face)
        for (int row = 0; row < edge; ++row)
          for (int column = 0; column < edge; ++column, texel += 4) {
            const auto n = static_cast<float>(edge);
            const Vec3f d =
                cube_direction(face, (static_cast<float>(column) + 0.5F) / n, (static_cast<float>(row) + 0.5F) / n);
            const Radiance expected =
                environment_radiance(map, rotate(rotation.inverse(), d), roughness) * scale.factor + scale.constant;
            // Directions have an error of 1e-6, which is 64e-6 texels; neighbours differ by up to their own value.
            for (int c = 0; c < 3; ++c)
              ASSERT_NEAR(texel[c], expected[c], 3e-4F * (std::ldexp(scale.factor, map.exponent) + scale.constant[c]))
                  << face << " " << row << " " << column << " roughness " << roughness;
          }
    }
}

INSTANTIATE_TEST_SUITE_P(Maps, EnvironmentPassTest,
                         testing::Values(Case{{{64, 0}, {32, 0.3F}, {16, 0.6F}, {8, 1}}, 0, {}},
                                         Case{{{64, 0}}, 12, {0.01F, {0.5F, 0.25F, 0}}},
                                         Case{{{16, 0.2F}, {16, 0.4F}}, -40, {2, {}}}, Case{{{8, 0.5F}}, 90, {1, {}}}));

TEST(EnvironmentPass, TheFirstLevelIsThatOfMirrors) {
  const auto context = HeadlessContext::make();
  ASSERT_TRUE(context.ok()) << context.status().message();
  auto pass = EnvironmentPass::make();
  ASSERT_TRUE(pass.ok()) << pass.status().message();
  EnvironmentMap map = random_map({{16, 0}, {16, 0.4F}}, 0);
  map.light_tracks = {1};
  map.light_runs = {30, 100};
  map.light_texels.assign(100, rgb9e5_encode(7, 8, 9));
  const EnvironmentMap mirror = first_level_with_lights(map);
  pass->upload({map, {}, 1, {}, mirror}, {});
  for (const float roughness : {0.0F, 0.1F, 0.4F}) {
    const std::vector<float> texels = drawn(*pass, map, 16, roughness);
    for (int face = 0, k = 0; face < 6; ++face)
      for (int row = 0; row < 16; ++row)
        for (int column = 0; column < 16; ++column, k += 4) {
          const Vec3f d =
              cube_direction(face, (static_cast<float>(column) + 0.5F) / 16, (static_cast<float>(row) + 0.5F) / 16);
          const float share = 1 - roughness / 0.4F;
          const Radiance expected =
              environment_radiance(mirror, d, 0) * share + environment_radiance(map, d, 0.4F) * (1 - share);
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(texels[static_cast<std::size_t>(k + c)], expected[c], 3e-3F) << roughness;
        }
  }
}

TEST(EnvironmentPass, RadianceBelowTheRangeOfFloatIsDark) {
  const auto context = HeadlessContext::make();
  ASSERT_TRUE(context.ok()) << context.status().message();
  auto pass = EnvironmentPass::make();
  ASSERT_TRUE(pass.ok()) << pass.status().message();
  const EnvironmentMap map = random_map({{8, 0}}, kMinEnvironmentExponent);
  pass->upload({map, {}, 1, {}, map}, {1, {}});
  for (const float v : drawn(*pass, map, 8, 0)) ASSERT_TRUE(v == 1 || (v >= 0 && v < 1e-38F)) << v;
}

}  // namespace
}  // namespace lightwell::test
