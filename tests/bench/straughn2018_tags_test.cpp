#include "bench/straughn2018_tags.hpp"

#include <gtest/gtest.h>

namespace lightwell::bench {
namespace {

constexpr int kWidth = 160, kHeight = 120, kCell = 8, kLeft = 40, kTop = 20;

/// Tag 5 of tag36h11, upright; its white margin starts at (kLeft, kTop).
std::vector<std::uint8_t> picture_of_a_tag(std::uint8_t dark, std::uint8_t bright) {
  std::vector<std::uint8_t> grey(kWidth * kHeight, bright);
  const TagBitmap bitmap = *tag_bitmap(TagFamily::tag36h11, 5);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const int column = (x - kLeft) / kCell, row = (y - kTop) / kCell;
      if (x >= kLeft && y >= kTop && column < bitmap.cells && row < bitmap.cells && bitmap.is_dark(column, row))
        grey[static_cast<std::size_t>(y * kWidth + x)] = dark;
    }
  return grey;
}

StraughnPicture view(const std::vector<std::uint8_t>& grey) { return {kWidth, kHeight, 1, grey, kWidth}; }

TEST(StraughnTags, FindsATagAndItsCornersInGreyAndInColour) {
  const auto grey = picture_of_a_tag(30, 220);
  std::vector<std::uint8_t> rgb;
  for (const std::uint8_t v : grey) rgb.insert(rgb.end(), 3, v);
  auto detector = StraughnTagDetector::make();
  ASSERT_TRUE(detector);
  // The black border is eight cells wide, inside the margin if the bitmap has one; pixel k is from k - 0.5 to k + 0.5.
  const double rim = tag_bitmap(TagFamily::tag36h11, 5)->cells == 10 ? kCell : 0;
  const double left = kLeft + rim - 0.5, top = kTop + rim - 0.5, size = 8 * kCell;
  for (const StraughnPicture& picture : {view(grey), StraughnPicture{kWidth, kHeight, 3, rgb, 3 * kWidth}}) {
    const auto tags = detector->detect(picture);
    ASSERT_TRUE(tags);
    ASSERT_EQ(tags->size(), 1U);
    EXPECT_EQ(tags->front().id, 5);
    const auto& c = tags->front().corners_px;
    EXPECT_NEAR(c[0].x, left, 0.1);
    EXPECT_NEAR(c[0].y, top + size, 0.1);
    EXPECT_NEAR(c[1].x, left + size, 0.1);
    EXPECT_NEAR(c[1].y, top + size, 0.1);
    EXPECT_NEAR(c[2].x, left + size, 0.1);
    EXPECT_NEAR(c[2].y, top, 0.1);
    EXPECT_NEAR(c[3].x, left, 0.1);
    EXPECT_NEAR(c[3].y, top, 0.1);
  }
}

TEST(StraughnTags, PassesFindATagOnceIfAnyThresholdSeparatesInkAndPaper) {
  // Ink 20 and paper 35 are separated only at 30; ink 20 and paper 200 at all four thresholds.
  auto detector = StraughnTagDetector::make({.thresholds = straughn_four_passes()});
  ASSERT_TRUE(detector);
  EXPECT_EQ(detector->detect(view(picture_of_a_tag(20, 35)))->size(), 1U);
  EXPECT_EQ(detector->detect(view(picture_of_a_tag(20, 200)))->size(), 1U);
  EXPECT_EQ(detector->detect(view(picture_of_a_tag(70, 200)))->size(), 0U);
}

TEST(StraughnTags, AnImageWithTooFewBytesIsRejected) {
  auto detector = StraughnTagDetector::make();
  ASSERT_TRUE(detector);
  const std::vector<std::uint8_t> few(kWidth * kHeight - 1);
  EXPECT_EQ(detector->detect(view(few)).status().code(), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell::bench
