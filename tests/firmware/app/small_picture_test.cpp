// The small picture of a frame: each pixel format, size, tone, and views that do not match.
#include "app/small_picture.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "firmware/app/preview_frames.hpp"

namespace lightwell {
namespace {

using test::ColumnPicture;
using test::FrameColor;
using test::kBlack;
using test::kBlue;
using test::kRed;
using test::kWhite;
using test::preview_rig;

using Rgb = std::array<int, 3>;

Rgb pixel(const Image& image, int x, int y) {
  const std::size_t at = image.stride() * static_cast<std::size_t>(y) + 3 * static_cast<std::size_t>(x);
  return {std::to_integer<int>(image.data[at]), std::to_integer<int>(image.data[at + 1]),
          std::to_integer<int>(image.data[at + 2])};
}

Image small_picture_of(const RigParameters& rig, const std::vector<View>& views) {
  const PictureReducer reducer(rig);
  SmallPicture small = reducer.blank();
  // What was there before must not remain.
  std::fill(small.rgb.begin(), small.rgb.end(), 0.7F);
  Frame frame;
  for (const View& view : views) frame.add_view(view);
  reducer.reduce(frame, small);
  return encode_srgb(small, reducer.width(), reducer.height());
}

TEST(SmallPicture, EveryFormatShowsRedOnTheLeftAndBlueOnTheRight) {
  for (const PixelFormat format : kPixelFormats) {
    SCOPED_TRACE(to_string(format));
    for (const int reduction : {1, 2, 3}) {
      const int width = 96 * reduction * 2, height = 80 * reduction * 2;
      const ColumnPicture picture(
          format, width, height, [&](int x) { return x < width / 2 ? kRed : kBlue; }, 40);
      const Image image = small_picture_of(preview_rig(1, width, height), {picture.view()});
      ASSERT_EQ(image.height, 160);
      ASSERT_EQ(image.width, 192);
      // BT.601's red and blue are rounded to codes: up to 2 of 255.
      for (const int y : {0, 80, 159}) {
        for (const int x : {0, 40, 95}) {
          EXPECT_GE(pixel(image, x, y)[0], 253) << x;
          EXPECT_LE(pixel(image, x, y)[2], 20) << x << " (a code of 1 is 13 in sRGB)";
        }
        for (const int x : {96, 140, 191}) {
          EXPECT_GE(pixel(image, x, y)[2], 253) << x;
          EXPECT_LE(pixel(image, x, y)[0], 20) << x;
        }
      }
    }
  }
}

TEST(SmallPicture, APixelIsTheLinearMeanOfItsArea) {
  const ColumnPicture stripes(PixelFormat::rgb8, 960, 480, [](int x) { return x % 3 == 1 ? kWhite : kBlack; });
  const Image image = small_picture_of(preview_rig(1, 960, 480), {stripes.view()});
  ASSERT_EQ(image.width, 320);
  ASSERT_EQ(image.height, 160);
  // sRGB of 1/3: 1.055 / 3^(1/2.4) - 0.055 = 0.6125.
  for (const int x : {0, 1, 160, 319}) EXPECT_EQ(pixel(image, x, 80), (Rgb{156, 156, 156})) << x;
}

TEST(SmallPicture, ToneIsThatOfTheFrameWithResponseBlackLevelAndWhiteBalance) {
  const FrameColor grey{{0.5F, 0.5F, 0.5F}, {}};
  const ColumnPicture picture(PixelFormat::rgb8, 16, 16, [&](int) { return grey; });
  RigParameters rig = preview_rig(1, 16, 16);
  const auto shown = [&] { return pixel(small_picture_of(rig, {picture.view()}), 3, 3); };
  // Linear code 128 of 255 is 0.502; sRGB of it 0.7365.
  EXPECT_EQ(shown(), (Rgb{188, 188, 188}));
  PhotometricCalibration& photometry = rig.lenses[0].photometry;
  photometry.response.kind = ResponseCurve::Kind::srgb;
  EXPECT_EQ(shown(), (Rgb{128, 128, 128})) << "an sRGB frame is shown as it is";
  photometry.response.kind = ResponseCurve::Kind::linear;
  photometry.black_level = 0.25;
  // (0.502 - 0.25) / 0.75 = 0.336; sRGB of it 0.6147.
  EXPECT_EQ(shown(), (Rgb{157, 157, 157}));
  photometry.black_level = 0;
  photometry.white_balance = {2.5, 1, 0.5};
  // 0.251: sRGB of it 0.5380.
  EXPECT_EQ(shown(), (Rgb{255, 188, 137}));
}

TEST(SmallPicture, FloatsAreShownWithTheirNinetyNinthPercentileAsWhite) {
  const auto color_of = [](int x) { return x == 7 ? kWhite : FrameColor{{0.01F, 0.005F, 0.01F}, {}}; };
  const ColumnPicture picture(PixelFormat::rgb_f32, 200, 8, color_of, 5000);
  const Image image = small_picture_of(preview_rig(1, 200, 8), {picture.view()});
  EXPECT_EQ(pixel(image, 7, 4), (Rgb{255, 255, 255}));
  EXPECT_EQ(pixel(image, 100, 4), (Rgb{255, 188, 255}));
}

TEST(SmallPicture, ABrokenFloatIsBlack) {
  ColumnPicture picture(PixelFormat::rgb_f32, 16, 16, [](int) { return kWhite; });
  const float broken[3] = {std::nanf(""), -1, INFINITY};
  std::memcpy(picture.data.data() + 5 * picture.stride + 12 * 3, broken, sizeof broken);
  const Image image = small_picture_of(preview_rig(1, 16, 16), {picture.view()});
  EXPECT_EQ(pixel(image, 3, 5), (Rgb{0, 0, 0}));
  EXPECT_EQ(pixel(image, 4, 5), (Rgb{255, 255, 255}));
}

TEST(SmallPicture, LensesStandSideBySide) {
  const RigParameters rig = preview_rig(2, 640, 480);
  ColumnPicture left(PixelFormat::rgb8, 640, 480, [](int) { return kRed; });
  ColumnPicture right(PixelFormat::rgb8, 640, 480, [](int) { return kBlue; });
  right.lens = 1;
  const Image both = small_picture_of(rig, {right.view(), left.view()});
  EXPECT_EQ(both.width, 320);
  EXPECT_EQ(both.height, 120);
  EXPECT_EQ(pixel(both, 159, 60), (Rgb{255, 0, 0}));
  EXPECT_EQ(pixel(both, 160, 60), (Rgb{0, 0, 255}));
  const Image one = small_picture_of(rig, {right.view()});
  EXPECT_EQ(pixel(one, 80, 60), (Rgb{0, 0, 0})) << "the camera of lens 0 is missing";
  EXPECT_EQ(pixel(one, 240, 60), (Rgb{0, 0, 255}));
}

TEST(SmallPicture, ViewsThatDoNotMatchTheCalibrationAreBlack) {
  const RigParameters rig = preview_rig(1, 32, 16);
  const ColumnPicture picture(PixelFormat::rgb8, 32, 16, [](int) { return kWhite; });
  View cut = picture.view(), other_size = picture.view(), other_lens = picture.view(), narrow = picture.view();
  cut.data = cut.data.first(cut.data.size() / 2);
  other_size.height = 8;
  other_lens.lens = 1;
  narrow.stride = 90;
  for (const View& view : {cut, other_size, other_lens, narrow})
    EXPECT_EQ(pixel(small_picture_of(rig, {view}), 4, 4), (Rgb{0, 0, 0}));
  EXPECT_EQ(pixel(small_picture_of(rig, {picture.view()}), 4, 4), (Rgb{255, 255, 255}));
}

}  // namespace
}  // namespace lightwell
