#include "bench/alhakamy2019.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "bench/scenes.hpp"

namespace lightwell::bench {
namespace {

namespace ref = lightwell::reference;

constexpr int kWidth = 1024, kHeight = 512;

/// An 8-bit frame with the values of `p`, without gamma, because only positions matter.
struct Frame {
  std::vector<std::uint8_t> pixels;

  explicit Frame(const ref::Panorama& p) {
    for (const double value : p.rgb) pixels.push_back(static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)));
  }
  [[nodiscard]] EquirectFrame frame() const { return {kWidth, kHeight, pixels, 3 * kWidth}; }
};

ref::Panorama room_with(const std::vector<std::pair<ref::V3, double>>& discs, const ref::Rgb& colour) {
  ref::Panorama p = ref::constant(kWidth, kHeight, {40, 40, 40});
  for (const auto& [direction, radius] : discs)
    p = ref::sum(p, ref::disc_lamp(kWidth, kHeight, ref::normalised(direction), radius, colour, 4));
  return p;
}

double degrees_off(const AlhakamyLight& light, const ref::V3& direction) {
  return ref::angle_deg({light.direction[0], light.direction[1], light.direction[2]}, direction);
}

TEST(AlhakamyDetection, FindsLampsLargestFirst) {
  const std::vector<std::pair<ref::V3, double>> discs{{{0.3, 0.4, -1}, 0.06}, {{-1, 0.2, -0.3}, 0.15}};
  const Frame frame(room_with(discs, {215, 205, 190}));
  const AlhakamyResult found = alhakamy_detect(frame.frame());
  ASSERT_EQ(found.lights.size(), 2U);
  EXPECT_EQ(found.median_grey, 40);
  EXPECT_EQ(found.threshold_grey, 148);
  // The centroid of a picture's area is not the sphere's: a disc of 0.15 rad at 11 degrees of latitude is off by
  // radius^2 / 4 * tan(latitude) and half a pixel (0.35 degrees) more.
  EXPECT_LT(degrees_off(found.lights[0], discs[1].first), 0.5);
  EXPECT_LT(degrees_off(found.lights[1], discs[0].first), 0.5);
  EXPECT_GT(found.lights[0].area_px, found.lights[1].area_px);
}

TEST(AlhakamyDetection, ColourAndIntensityAreThoseOfTheLamp) {
  const Frame frame(room_with({{{0, 0, -1}, 0.2}}, {215, 165, 115}));
  const AlhakamyResult found = alhakamy_detect(frame.frame());
  ASSERT_EQ(found.lights.size(), 1U);
  // Two more dilations than erosions add two pixels of the room around a disc of 33: up to 13 % of the area.
  const ref::Rgb lamp{255, 205, 155};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_LT(found.lights[0].colour[c], lamp[c] + 1);
    EXPECT_GT(found.lights[0].colour[c], 0.87 * lamp[c]);
  }
  EXPECT_NEAR(found.lights[0].intensity, 0.2126 * 1.0 + 0.7152 * 0.804 + 0.0722 * 0.608, 0.1);
  EXPECT_GT(found.lights[0].shadow_strength, 0.5);
  EXPECT_LT(found.lights[0].shadow_strength, 1);
}

TEST(AlhakamyDetection, SpecksAreErodedAway) {
  ref::Panorama p = room_with({{{0, 0, -1}, 0.1}}, {215, 215, 215});
  ref::set_pixel(p, 100, 100, {255, 255, 255});
  EXPECT_EQ(alhakamy_detect(Frame(p).frame()).lights.size(), 1U);
}

TEST(AlhakamyDetection, TheLiteralMedianThresholdKeepsHalfOfTheImage) {
  // Brightness decreases from top to bottom: half of the rows are at or above the median.
  const Frame frame(ref::from_function(
      kWidth, kHeight,
      [](const ref::V3& d) {
        const double grey = 127 + 254 / ref::pi * std::asin(d.y);
        return ref::Rgb{grey, grey, grey};
      },
      1));
  AlhakamyOptions letter;
  letter.threshold = AlhakamyOptions::Threshold::median;
  const AlhakamyResult found = alhakamy_detect(frame.frame(), letter);
  ASSERT_EQ(found.lights.size(), 1U);
  EXPECT_NEAR(found.median_grey, 127, 1);
  EXPECT_EQ(found.threshold_grey, found.median_grey);
  EXPECT_NEAR(found.lights[0].area_px, 0.5 * kWidth * kHeight, 0.02 * kWidth * kHeight);
}

TEST(AlhakamyDetection, AUniformFrameBelowWhiteAndAnEmptyOneHaveNoLights) {
  EXPECT_TRUE(alhakamy_detect(Frame(room_with({}, {})).frame()).lights.empty());
  EXPECT_TRUE(alhakamy_detect({}).lights.empty());
}

TEST(AlhakamyDetection, ManyLampsAreCutToTheMainOnes) {
  std::vector<std::pair<ref::V3, double>> discs;
  for (const ref::V3& d : ref::fibonacci_normals(12)) discs.emplace_back(d, 0.12);
  const AlhakamyResult found = alhakamy_detect(Frame(room_with(discs, {215, 215, 215})).frame());
  EXPECT_EQ(found.lights.size(), 8U);
  EXPECT_GE(found.contours, 12);  // A lamp across the seam gives two contours.
}

}  // namespace
}  // namespace lightwell::bench
