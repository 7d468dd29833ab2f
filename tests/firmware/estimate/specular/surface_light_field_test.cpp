// Storage of a surface light field.
#include "estimate/specular/surface_light_field.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/pixel.hpp>

namespace lightwell::specular {
namespace {

constexpr std::size_t kPlenty = 64U << 20U;

class SurfaceLightFieldTest : public ::testing::Test {
 protected:
  static Vec3d lens(int k) {
    const Vec3d d = fibonacci_direction(k, 400);
    return Vec3d{d.x, d.y, std::abs(d.z) + 0.1} * 0.4;
  }
  TexelImage uniform(float value) const { return TexelImage(texels_.count(), {value, value / 2, value / 4, 0}); }

  const PlaneTexels texels_{0.2, 64};
};

// The direction of a texel is that of its tile.
TEST_F(SurfaceLightFieldTest, HoldsOneSampleForEachTexelAndVisitedDirection) {
  SurfaceLightField field(texels_, 60, kPlenty);
  std::set<std::pair<std::size_t, std::uint32_t>> visited;
  for (std::uint32_t frame = 0; frame < 50; ++frame) {
    const Vec3d from = lens(static_cast<int>(frame));
    std::size_t fresh = 0;
    for (int tile = 0; tile < texels_.tiles() * texels_.tiles(); ++tile)
      for (int k = 0; k < kTileTexels; ++k)
        fresh += visited
                     .insert({texels_.texel_of(tile, k),
                              field.grid().nearest(vec_cast<float>(from - texels_.tile_center(tile)))})
                     .second;
    EXPECT_EQ(field.add(uniform(1), {from, 0.002}, frame).size(), fresh);
  }
  EXPECT_EQ(field.samples(), visited.size());
  // All of them are found again, each once, with its value.
  std::uint64_t found = 0;
  for (int tile = 0; tile < texels_.tiles() * texels_.tiles(); ++tile)
    field.for_each_page(tile, [&](const LightFieldPage& page) {
      EXPECT_EQ(page.tile, tile);
      for (int k = 0; k < kTileTexels; ++k) {
        if ((page.filled >> k & 1) == 0) continue;
        ++found;
        EXPECT_TRUE(visited.count({texels_.texel_of(tile, k), page.node}));
        EXPECT_EQ(page.sample[static_cast<std::size_t>(k)], rgb9e5_encode(1, 0.5F, 0.25F));
      }
    });
  EXPECT_EQ(found, visited.size());
  EXPECT_NEAR(field.fill(), static_cast<double>(found) / (4096.0 * 7321), 1e-12);
}

// What one direction for a tile costs: texels of 0.8 mm at 0.4 m are off by at most a quarter of a spacing.
TEST_F(SurfaceLightFieldTest, TheDirectionOfATileIsThatOfItsTexels) {
  const PlaneTexels texels{0.2, 256};
  const double spacing = HemisphereGrid(60).spacing_rad();
  for (const Vec3d from : {Vec3d{0.05, 0, 0.4}, Vec3d{0.3, 0.1, 0.25}, Vec3d{-0.1, 0.38, 0.06}})
    for (int tile = 0; tile < texels.tiles() * texels.tiles(); ++tile)
      for (int k = 0; k < kTileTexels; ++k)
        ASSERT_LT(angle_between(from - texels.tile_center(tile), from - texels.center(texels.texel_of(tile, k))),
                  0.25 * spacing * 0.4 / length(from - texels.tile_center(tile)));
}

TEST_F(SurfaceLightFieldTest, ANewerSampleReplacesAnOlderOne) {
  SurfaceLightField field(texels_, 60, kPlenty);
  (void)field.add(uniform(1), {{0, 0, 0.5}, 0.002}, 7);
  EXPECT_TRUE(field.add(uniform(2), {{0, 0, 0.5}, 0.002}, 8).empty());
  EXPECT_EQ(field.samples(), texels_.count());
  field.for_each_page(0, [](const LightFieldPage& page) {
    EXPECT_EQ(page.frame, 8U);
    EXPECT_EQ(rgb9e5_decode(page.sample[0])[0], 2);
  });
}

TEST_F(SurfaceLightFieldTest, StoresOnlyWhatIsMeasured) {
  SurfaceLightField field(texels_, 60, kPlenty);
  TexelImage image(texels_.count());
  image[5] = {1, 1, 1, 0};
  image[9] = {1, 1, 1, 0.2F};  // Beside a saturated pixel.
  const auto first = field.add(image, {{0, 0, 0.5}, 0.002}, 0);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0], 5U);
  // One tile was seen, from one direction.
  EXPECT_EQ(std::ranges::count(field.visited(), std::uint8_t{1}), 1);
}

TEST_F(SurfaceLightFieldTest, WhereMemoryEndsEveryDirectionKeepsSamples) {
  const PlaneTexels texels{0.2, 128};
  const TexelImage image(texels.count(), {1, 1, 1, 0});
  SurfaceLightField field(texels, 60, SurfaceLightField::kMinBytes);
  SurfaceLightField whole(texels, 60, kPlenty);
  for (std::uint32_t frame = 0; frame < 300; ++frame) {
    (void)field.add(image, {lens(static_cast<int>(frame)), 0.002}, frame);
    (void)whole.add(image, {lens(static_cast<int>(frame)), 0.002}, frame);
  }
  EXPECT_GT(field.removed(), 0U);
  EXPECT_EQ(whole.removed(), 0U);
  EXPECT_TRUE(std::ranges::equal(field.visited(), whole.visited()));
  EXPECT_LT(field.bytes(), SurfaceLightField::kMinBytes + (1U << 20U));
  std::vector<int> samples(field.grid().size()), of_whole(field.grid().size());
  const auto count = [&](const SurfaceLightField& f, std::vector<int>& out) {
    std::uint64_t sum = 0;
    for (int tile = 0; tile < texels.tiles() * texels.tiles(); ++tile)
      f.for_each_page(tile, [&](const LightFieldPage& page) {
        out[page.node] += std::popcount(page.filled);
        sum += static_cast<std::uint64_t>(std::popcount(page.filled));
      });
    return sum;
  };
  EXPECT_EQ(count(field, samples), field.samples());
  (void)count(whole, of_whole);
  int seen = 0, lost = 0;
  for (std::size_t node = 0; node < samples.size(); ++node) {
    seen += of_whole[node] > 100 ? 1 : 0;
    lost += of_whole[node] > 100 && samples[node] == 0 ? 1 : 0;
  }
  EXPECT_GT(seen, 3000);
  // Memory for a tenth of the samples: the oldest directions keep a tenth of their pages, or none of a few.
  EXPECT_LT(lost, seen / 20);
}

TEST_F(SurfaceLightFieldTest, SamplesBeforeAChangeOfTheLightAreRemoved) {
  SurfaceLightField field(texels_, 20, kPlenty);
  (void)field.add(uniform(1), {{0, 0, 0.4}, 0.002}, 3);
  (void)field.add(uniform(1), {{0.3, 0, 0.3}, 0.002}, 4);
  const std::uint64_t both = field.samples();
  // The direction of frame 3 is visited again; those of frame 4 are not.
  (void)field.add(uniform(2), {{0, 0, 0.4}, 0.002}, 5);
  EXPECT_EQ(field.samples(), both);
  field.remove_before(5);
  EXPECT_EQ(field.samples(), both / 2);
  EXPECT_EQ(field.removed(), 0U) << "for lack of memory";
  int pages = 0;
  for (int tile = 0; tile < texels_.tiles() * texels_.tiles(); ++tile)
    field.for_each_page(tile, [&](const LightFieldPage& page) {
      ++pages;
      EXPECT_EQ(page.frame, 5U);
      EXPECT_EQ(field.visited()[page.node], 1);
    });
  EXPECT_EQ(pages, texels_.tiles() * texels_.tiles());
  field.remove_before(6);
  EXPECT_EQ(field.samples(), 0U);
  EXPECT_EQ(field.pages(), 0U);
  for (const std::uint8_t visited : field.visited()) EXPECT_EQ(visited, 0);
  EXPECT_EQ(field.add(uniform(1), {{0, 0, 0.4}, 0.002}, 7).size(), texels_.count());
}

TEST_F(SurfaceLightFieldTest, KnowsTheLensOfAFrame) {
  SurfaceLightField field(texels_, 20, kPlenty);
  (void)field.add(uniform(1), {{0.1, 0.2, 0.3}, 0.002}, 3);
  ASSERT_NE(field.view_of(3), nullptr);
  EXPECT_FLOAT_EQ(field.view_of(3)->lens.y, 0.2F);
  (void)field.add(uniform(1), {{0, 0, 0.3}, 0.002}, 3 + SurfaceLightField::kFrames);
  EXPECT_EQ(field.view_of(3), nullptr);
}

}  // namespace
}  // namespace lightwell::specular
