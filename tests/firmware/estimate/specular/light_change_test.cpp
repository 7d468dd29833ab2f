#include "estimate/specular/light_change.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace lightwell::specular {
namespace {

constexpr PlaneTexels kTexels{0.2, 128};
constexpr int kFrames = LightChange::kFrames;
const ViewPoint kAbove{{0, 0, 0.4}, 0.002};

/// A texture in waves times `gain`, with a mirror image that is brighter to one side.
TexelImage plane(double gain, double mirrored, double phase = 0) {
  TexelImage out(kTexels.count());
  for (std::size_t k = 0; k < out.size(); ++k) {
    const double x = static_cast<double>(k % 128) / 128, y = static_cast<double>(k / 128) / 128;
    const auto v = static_cast<float>(gain * (0.3 + 0.2 * std::sin(30 * x + phase) * std::cos(23 * y)) + mirrored * x);
    out[k] = {v, v, v, 0};
  }
  return out;
}

/// The first of `frames` frames after which a change is reported.
std::optional<LightChange::Change> change_in(LightChange& change, const TexelImage& image, int frames,
                                             std::uint32_t first = 100) {
  for (int k = 0; k < frames; ++k)
    if (const auto found = change.add(image, kAbove, plane(1, 0), first + static_cast<std::uint32_t>(k))) return found;
  return std::nullopt;
}

TEST(LightChange, IsFoundWithItsFirstFrameAndGain) {
  for (const double gain : {0.2, 0.5, 0.8, 1.3, 4.0}) {
    LightChange change(kTexels);
    EXPECT_FALSE(change_in(change, plane(1, 0.05), 5, 0));
    EXPECT_FALSE(change_in(change, plane(gain, 0.05), kFrames - 1));
    const auto found = change.add(plane(gain, 0.05), kAbove, plane(1, 0), 200);
    ASSERT_TRUE(found) << gain;
    EXPECT_EQ(found->since, 100u);
    // The mirror image is linear over the plane: only rounding remains.
    EXPECT_NEAR(found->gain, gain, 1e-4);
  }
}

TEST(LightChange, AMirrorImageAHandAndOtherTexturesAreNone) {
  LightChange change(kTexels);
  EXPECT_FALSE(change_in(change, plane(1, 0.8), 100));
  EXPECT_FALSE(change_in(change, plane(1.15, 0), 100)) << "too small";
  EXPECT_FALSE(change_in(change, plane(0.5, 0, 2), 100)) << "another texture";
  TexelImage hand = plane(1, 0);
  for (std::size_t k = 0; k < hand.size() / 2; ++k) hand[k] = {0.1F, 0.1F, 0.1F, 0};
  EXPECT_FALSE(change_in(change, hand, 100));
}

TEST(LightChange, FewerFramesAreAFlash) {
  LightChange change(kTexels);
  for (int k = 0; k < 20; ++k) {
    EXPECT_FALSE(change_in(change, plane(2, 0), kFrames - 1));
    EXPECT_FALSE(change_in(change, plane(1, 0), 1));
    EXPECT_FALSE(change_in(change, plane(0.5, 0), kFrames / 2));
    EXPECT_FALSE(change_in(change, plane(2, 0), kFrames - 1)) << "less and more is not one change";
    EXPECT_FALSE(change_in(change, plane(1, 0), 1));
  }
}

TEST(LightChange, WithoutTextureOrSightNothingIsSaid) {
  const TexelImage unseen(kTexels.count());
  TexelImage black(kTexels.count(), {0, 0, 0, 0}), saturated(kTexels.count(), {1, 1, 1, 1});
  TexelImage flat(kTexels.count(), {0.5F, 0.5F, 0.5F, 0});
  constexpr float kLargest = std::numeric_limits<float>::max() / 4;
  TexelImage huge(kTexels.count(), {kLargest, kLargest, kLargest, 0});
  for (const TexelImage& image : {unseen, black, saturated, flat, huge}) {
    LightChange change(kTexels);
    EXPECT_FALSE(change_in(change, image, 100));
    for (std::uint32_t k = 0; k < 100; ++k) EXPECT_FALSE(change.add(plane(0.5, 0), kAbove, image, k));
  }
}

TEST(LightChange, GrazingViewsSayNothing) {
  LightChange change(kTexels);
  const ViewPoint grazing{{0.4, 0, 0.02}, 0.002}, behind{{0, 0, -0.4}, 0.002}, within{{0, 0, 0}, 0.002};
  for (const ViewPoint& from : {grazing, behind, within})
    for (std::uint32_t k = 0; k < 50; ++k) EXPECT_FALSE(change.add(plane(0.5, 0), from, plane(1, 0), k));
}

TEST(LightChange, SmallTexturesHaveFewerCells) {
  const PlaneTexels small{0.2, 8};
  LightChange change(small);
  TexelImage image(small.count(), {0.5F, 0.5F, 0.5F, 0});
  for (std::uint32_t k = 0; k < 20; ++k) EXPECT_FALSE(change.add(image, kAbove, image, k));
}

}  // namespace
}  // namespace lightwell::specular
