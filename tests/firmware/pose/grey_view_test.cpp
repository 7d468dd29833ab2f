// GreyView: conversion of each pixel format to a grey picture.
#include "pose/grey_view.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/response.hpp"

namespace lightwell {
namespace {

constexpr int kWidth = 6, kHeight = 4;
/// Padding bytes after each row, which must not be read.
constexpr std::size_t kPadding = 8;
constexpr std::byte kPoison{0xAA};

/// A picture with padded rows.
struct Picture {
  PixelFormat format = PixelFormat::rgb8;
  int width = kWidth, height = kHeight;
  std::size_t stride;
  std::vector<std::byte> data;

  explicit Picture(PixelFormat of, int w = kWidth, int h = kHeight)
      : format(of),
        width(w),
        height(h),
        stride(packed_stride(of, w) + kPadding),
        data(picture_bytes(of, stride, h), kPoison) {}

  void byte(int x, int y, std::size_t step, std::size_t channel, unsigned value) {
    data[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x) * step + channel] =
        static_cast<std::byte>(value);
  }
  void word(int x, int y, unsigned value) {
    byte(x, y, 2, 0, value & 255U);
    byte(x, y, 2, 1, value >> 8);
  }
  void floats(int x, int y, std::array<float, 3> rgb) {
    std::memcpy(data.data() + static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x) * 12, rgb.data(),
                sizeof rgb);
  }
  [[nodiscard]] View view() const { return {0, format, width, height, stride, data}; }
};

/// A value that differs between pixels.
unsigned code(int x, int y) { return static_cast<unsigned>(20 + 30 * x + 7 * y); }

void expect_size(const GreyPicture& grey, const Picture& picture) {
  ASSERT_TRUE(grey.validate().ok()) << grey.validate().message();
  ASSERT_EQ(grey.width, picture.width);
  ASSERT_EQ(grey.height, picture.height);
}

TEST(GreyView, OfRgbIsAQuarterRedHalfGreenAQuarterBlue) {
  Picture picture(PixelFormat::rgb8);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      picture.byte(x, y, 3, 0, code(x, y));
      picture.byte(x, y, 3, 1, 255 - code(x, y));
      picture.byte(x, y, 3, 2, static_cast<unsigned>(3 * x));
    }
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double mean = (code(x, y) + 2.0 * (255 - code(x, y)) + 3.0 * x) / 4;
      EXPECT_NEAR(grey.at(x, y), mean, 0.5) << x << " " << y;
    }
}

TEST(GreyView, OfNv12IsItsLumaWithoutACopy) {
  Picture picture(PixelFormat::nv12);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) picture.byte(x, y, 1, 0, code(x, y));
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  EXPECT_EQ(grey.data.data(), reinterpret_cast<const std::uint8_t*>(picture.data.data())) << "no copy";
  EXPECT_EQ(grey.stride, picture.stride);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) EXPECT_EQ(grey.at(x, y), code(x, y)) << x << " " << y;
}

TEST(GreyView, OfYuyvIsEveryOtherByte) {
  Picture picture(PixelFormat::yuyv);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      picture.byte(x, y, 2, 0, code(x, y));
      picture.byte(x, y, 2, 1, 128);
    }
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) EXPECT_EQ(grey.at(x, y), code(x, y)) << x << " " << y;
}

struct Mosaic {
  PixelFormat format;
  unsigned scale;  ///< Factor from eight bits to the format's depth.
};

class GreyOfMosaic : public ::testing::TestWithParam<Mosaic> {
 protected:
  static void set(Picture& picture, int x, int y, unsigned eight_bits) {
    if (picture.format == PixelFormat::bayer_rggb8) {
      picture.byte(x, y, 1, 0, eight_bits);
    } else {
      picture.word(x, y, eight_bits * GetParam().scale);
    }
  }
};

TEST_P(GreyOfMosaic, IsGreenAloneWhateverRedAndBlueAre) {
  Picture picture(GetParam().format);
  // RGGB: green where x + y is odd.
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) set(picture, x, y, (x + y) % 2 == 1 ? 100 : (y % 2 == 0 ? 255 : 3));
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      EXPECT_EQ(grey.at(x, y), 100) << x << " " << y << ", including the picture's edges";
}

TEST_P(GreyOfMosaic, KeepsGreenSitesAndInterpolatesOthers) {
  Picture picture(GetParam().format);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) set(picture, x, y, code(x, y));
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  EXPECT_EQ(grey.at(3, 2), code(3, 2));
  // The mean of the neighbours of a linear function is its value.
  EXPECT_EQ(grey.at(2, 2), code(2, 2));
  EXPECT_EQ(grey.at(1, 1), code(1, 1));
}

INSTANTIATE_TEST_SUITE_P(Bits, GreyOfMosaic,
                         ::testing::Values(Mosaic{PixelFormat::bayer_rggb8, 1}, Mosaic{PixelFormat::bayer_rggb10, 4},
                                           Mosaic{PixelFormat::bayer_rggb12, 16}),
                         [](const auto& of) { return std::string(to_string(of.param.format)); });

TEST(GreyView, SamplesAboveTheBitDepthAreWhite) {
  Picture picture(PixelFormat::bayer_rggb10);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) picture.word(x, y, 0xFFFF);
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  EXPECT_EQ(grey.at(2, 2), 255);
  EXPECT_EQ(grey.at(3, 2), 255);
}

/// Green increases with x. The picture is large enough that 1 % of its pixels are several.
Picture floats(float scale) {
  Picture picture(PixelFormat::rgb_f32, 64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) picture.floats(x, y, {-7, scale * static_cast<float>(x + 1) / 64, 1e9F});
  return picture;
}

TEST(GreyView, OfFloatsIsTheNormalizedSquareRootOfGreen) {
  for (const float scale : {1e-6F, 1.0F, 1e6F}) {
    const Picture picture = floats(scale);
    GreyView view;
    const GreyPicture grey = view.of(picture.view());
    expect_size(grey, picture);
    // White is estimated from a sample, so it may be the second brightest column: a relative error of 1 / 64, half of
    // that after the square root, plus rounding.
    for (int x = 0; x < 64; ++x)
      EXPECT_NEAR(grey.at(x, 5), 255 * std::sqrt((x + 1) / 64.0), 255 / 128.0 + 0.6) << scale << " " << x;
  }
}

TEST(GreyView, AFewVeryBrightPixelsDoNotDarkenAFloatPicture) {
  Picture picture = floats(1);
  for (int x = 0; x < 16; ++x) picture.floats(x, 40, {1e6F, 1e6F, 1e6F});
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  EXPECT_EQ(grey.at(3, 40), 255);
  EXPECT_NEAR(grey.at(31, 5), 255 * std::sqrt(0.5), 4);
}

TEST(GreyView, NonFiniteFloatsAreBlackOrWhiteAndDoNotAffectOthers) {
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  Picture picture = floats(1);
  picture.floats(0, 0, {nan, nan, nan});
  picture.floats(1, 0, {0, -1, 0});
  picture.floats(2, 0, {0, -inf, 0});
  picture.floats(3, 0, {0, inf, 0});
  for (int x = 8; x < 64; ++x) picture.floats(x, 1, {nan, nan, nan});
  GreyView view;
  const GreyPicture grey = view.of(picture.view());
  expect_size(grey, picture);
  EXPECT_EQ(grey.at(0, 0), 0);
  EXPECT_EQ(grey.at(1, 0), 0);
  EXPECT_EQ(grey.at(2, 0), 0);
  EXPECT_EQ(grey.at(3, 0), 255);
  EXPECT_NEAR(grey.at(31, 5), 255 * std::sqrt(0.5), 4);
}

TEST(GreyView, FloatPicturesWithoutPositiveValuesAreBlack) {
  Picture picture(PixelFormat::rgb_f32);
  for (const float v : {0.0F, std::nanf(""), -3.0F}) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) picture.floats(x, y, {v, v, v});
    GreyView view;
    const GreyPicture grey = view.of(picture.view());
    expect_size(grey, picture);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) EXPECT_EQ(grey.at(x, y), 0) << v;
  }
}

TEST(GreyView, AViewWithTooFewBytesGivesAnEmptyPicture) {
  for (const PixelFormat format : kPixelFormats) {
    const Picture picture(format);
    GreyView view;
    ASSERT_EQ(view.of(picture.view()).width, kWidth) << to_string(format);
    const auto is_empty = [&](const View& of) {
      const GreyPicture grey = view.of(of);
      return grey.data.empty() && grey.width == 0 && grey.height == 0;
    };
    View shorter = picture.view();
    shorter.data = shorter.data.first(shorter.data.size() - 1);
    EXPECT_TRUE(is_empty(shorter)) << to_string(format) << ": one byte too few";
    View narrow = picture.view();
    narrow.stride = packed_stride(format, kWidth) - 1;
    EXPECT_TRUE(is_empty(narrow)) << to_string(format) << ": rows overlap";
    View none = picture.view();
    none.data = {};
    EXPECT_TRUE(is_empty(none)) << to_string(format);
    for (const int size : {-4, 0, 1}) {
      View tiny = picture.view();
      tiny.width = size;
      EXPECT_TRUE(is_empty(tiny)) << to_string(format) << " " << size;
      tiny = picture.view();
      tiny.height = size;
      EXPECT_TRUE(is_empty(tiny)) << to_string(format) << " " << size;
    }
  }
}

TEST(GreyView, ReusesTheMemoryOfALargerPicture) {
  GreyView view;
  const Picture large(PixelFormat::rgb8, 40, 30);
  ASSERT_EQ(view.of(large.view()).data.size(), 1200U);
  Picture small(PixelFormat::rgb8);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (std::size_t c = 0; c < 3; ++c) small.byte(x, y, 3, c, code(x, y));
  const GreyPicture grey = view.of(small.view());
  expect_size(grey, small);
  EXPECT_EQ(grey.at(5, 3), code(5, 3));
}

TEST(GreyView, LinearOfGreyInvertsTheConversion) {
  PhotometricCalibration webcam;
  webcam.response.kind = ResponseCurve::Kind::srgb;
  EXPECT_EQ(linear_of_grey(PixelFormat::rgb8, webcam), linear_table(webcam, 256));
  EXPECT_EQ(linear_of_grey(PixelFormat::yuyv, webcam), linear_table(webcam, 256));
  const std::vector<float> of_floats = linear_of_grey(PixelFormat::rgb_f32, webcam);
  ASSERT_EQ(of_floats.size(), 256U);
  EXPECT_FLOAT_EQ(of_floats[0], 0);
  EXPECT_FLOAT_EQ(of_floats[255], 1);
  EXPECT_NEAR(of_floats[180], std::pow(180 / 255.0, 2), 1e-6) << "GreyView took the root, not the response";
}

}  // namespace
}  // namespace lightwell
