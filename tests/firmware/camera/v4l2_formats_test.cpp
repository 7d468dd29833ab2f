// Tests of the layout of driver buffers and of the unpacking of pixels.
#include <array>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "camera/backends/v4l2/control_delay.hpp"
#include "camera/backends/v4l2/formats.hpp"
#include "firmware/camera/v4l2_picture.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell::v4l2 {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> all;
  for (const int v : values) all.push_back(static_cast<std::byte>(v));
  return all;
}

TEST(Unpack, TenBitsAreOneByteAndTwoBitsOfTheFifth) {
  std::array<std::uint16_t, 4> pixels{};
  unpack10(bytes({0x00, 0xFF, 0x80, 0x01, 0b11'10'01'00}), pixels);
  EXPECT_THAT(pixels, ElementsAre(0x000, 0x3FD, 0x202, 0x007));
}

TEST(Unpack, TwelveBitsAreOneByteAndFourBitsOfTheThird) {
  std::array<std::uint16_t, 2> pixels{};
  unpack12(bytes({0x12, 0xFE, 0x43}), pixels);
  EXPECT_THAT(pixels, ElementsAre(0x123, 0xFE4));
}

TEST(Unpack, FullScaleStaysFullScale) {
  std::array<std::uint16_t, 4> ten{};
  unpack10(bytes({255, 255, 255, 255, 255}), ten);
  EXPECT_THAT(ten, ::testing::Each(1023));
  std::array<std::uint16_t, 2> twelve{};
  unpack12(bytes({255, 255, 255}), twelve);
  EXPECT_THAT(twelve, ::testing::Each(4095));
}

TEST(Encodings, EachOccursOnceAndIsFoundByName) {
  std::set<std::uint32_t> seen;
  for (const Encoding& e : encodings()) {
    EXPECT_TRUE(seen.insert(e.fourcc).second) << fourcc_text(e.fourcc);
    EXPECT_EQ(encoding_of(e.fourcc), &e);
    EXPECT_THAT(format_names(), HasSubstr(std::string(e.name)));
  }
  EXPECT_EQ(encoding_of(V4L2_PIX_FMT_H264), nullptr);
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_YUYV), "YUYV");
  EXPECT_EQ(fourcc_text(0x01020359), "Y...");
}

Layout layout(std::uint32_t fourcc, int width, int height, std::size_t stride, std::size_t bytes, bool copied = false) {
  const Result<Layout> made = layout_of(*encoding_of(fourcc), width, height, stride, bytes, copied);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return made ? *made : Layout{};
}

std::string refusal(std::uint32_t fourcc, int width, int height, std::size_t stride, std::size_t bytes) {
  return layout_of(*encoding_of(fourcc), width, height, stride, bytes, false).status().message();
}

TEST(LayoutOf, KeepsThePaddingOfTheDriver) {
  const Layout yuyv = layout(V4L2_PIX_FMT_YUYV, 640, 480, 1344, 1344 * 480);
  EXPECT_EQ(yuyv.view_stride, 1344U);
  EXPECT_EQ(yuyv.bytes, 1344U * 480);
  const Layout nv12 = layout(V4L2_PIX_FMT_NV12, 640, 480, 704, 704 * 720);
  EXPECT_EQ(nv12.bytes, 704U * 720) << "chroma has the stride of luma";
  EXPECT_EQ(layout(V4L2_PIX_FMT_YUYV, 640, 480, 0, 640 * 960).stride, 1280U) << "0 means no padding";
}

TEST(LayoutOf, CopiedOrConvertedPicturesHaveNoPadding) {
  EXPECT_EQ(layout(V4L2_PIX_FMT_YUYV, 640, 480, 1344, 1344 * 480, true).view_stride, 1280U);
  const Layout packed = layout(V4L2_PIX_FMT_SRGGB10P, 640, 480, 832, 832 * 480);
  EXPECT_EQ(packed.view_stride, 1280U);
  EXPECT_EQ(packed.picture_bytes, 1280U * 480);
  EXPECT_EQ(packed.bytes, 832U * 479 + 800) << "after the last row no padding is needed";
  EXPECT_EQ(layout(V4L2_PIX_FMT_MJPEG, 640, 480, 0, 100000).picture_bytes, 640U * 480 * 3);
}

TEST(LayoutOf, OtherBayerOrdersBeginAtTheFirstRedPixel) {
  const auto expect = [](std::uint32_t fourcc, int width, int height, std::size_t offset) {
    const Layout l = layout(fourcc, 640, 480, 704, 704 * 480);
    EXPECT_EQ(l.view_width, width) << fourcc_text(fourcc);
    EXPECT_EQ(l.view_height, height) << fourcc_text(fourcc);
    EXPECT_EQ(l.view_offset, offset) << fourcc_text(fourcc);
  };
  expect(V4L2_PIX_FMT_SRGGB8, 640, 480, 0);
  expect(V4L2_PIX_FMT_SGRBG8, 638, 478, 1);
  expect(V4L2_PIX_FMT_SGBRG8, 640, 478, 704);
  expect(V4L2_PIX_FMT_SBGGR8, 638, 478, 705);
  EXPECT_EQ(layout(V4L2_PIX_FMT_SBGGR12, 640, 480, 1280, 1280 * 480).view_offset, 1282U) << "pixels of two bytes";
}

TEST(LayoutOf, AViewIsInsideTheBuffer) {
  for (const Encoding& e : encodings()) {
    const std::size_t row = test::packed_row_bytes(e.fourcc, 64);
    for (const bool copied : {false, true}) {
      const Layout l =
          layout(e.fourcc, 64, 48, 0, test::encoded_bytes(e.fourcc, std::max<std::size_t>(row, 128), 64, 48), copied);
      const View view = view_of(e, l, std::span(static_cast<const std::byte*>(nullptr), l.picture_bytes));
      EXPECT_LE(l.view_offset + picture_bytes(view.format, view.stride, view.height), l.picture_bytes);
      EXPECT_EQ(view.data.size(), picture_bytes(view.format, view.stride, view.height));
    }
  }
}

TEST(LayoutOf, UnsupportedPicturesAreRefused) {
  EXPECT_THAT(refusal(V4L2_PIX_FMT_YUYV, 641, 480, 1282, 1 << 20), HasSubstr("even sizes"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_NV12, 640, 481, 640, 1 << 20), HasSubstr("even sizes"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_YUYV, 640, 480, 1278, 1 << 20), HasSubstr("overlap"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_YUYV, 640, 480, 1280, 640 * 960 - 1), HasSubstr("bytes, and they need"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_SRGGB10, 640, 480, 1281, 1 << 20), HasSubstr("aligned"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_SRGGB10P, 642, 480, 900, 1 << 20), HasSubstr("whole bytes"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_YUYV, 0, 480, 0, 1 << 20), HasSubstr("no size"));
  EXPECT_THAT(refusal(V4L2_PIX_FMT_SBGGR8, 640, 2, 640, 1 << 20), HasSubstr("no size")) << "no rows would be left";
  EXPECT_THAT(refusal(V4L2_PIX_FMT_MJPEG, 65536, 480, 0, 1 << 20), HasSubstr("no size"));
}

TEST(Converter, UnpacksRowByRowPastThePadding) {
  constexpr int kWidth = 16, kHeight = 6;
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_SGBRG10P, V4L2_PIX_FMT_SBGGR12P}) {
    const std::size_t stride = test::packed_row_bytes(fourcc, kWidth) + 7;
    std::vector<std::byte> driver(stride * kHeight);
    test::draw_picture(fourcc, kWidth, kHeight, stride, 0.8, 0, driver);
    const Encoding& encoding = *encoding_of(fourcc);
    const Layout l = layout(fourcc, kWidth, kHeight, stride, driver.size());
    std::vector<std::uint16_t> words(l.picture_bytes / 2);
    Converter converter(encoding, l);
    ASSERT_TRUE(converter.convert(driver, std::as_writable_bytes(std::span(words))));
    const View view = view_of(encoding, l, std::as_bytes(std::span(words)));
    const auto* const first = reinterpret_cast<const std::uint16_t*>(view.data.data());
    const auto* const second = reinterpret_cast<const std::uint16_t*>(view.data.data() + view.stride);
    const double most = encoding.format == PixelFormat::bayer_rggb10 ? 1023 : 4095;
    EXPECT_NEAR(first[0] / most, 0.8, 0.001) << "red";
    EXPECT_NEAR(first[1] / most, 0.4, 0.001) << "green";
    EXPECT_NEAR(second[0] / most, 0.4, 0.001) << "green";
    EXPECT_NEAR(second[1] / most, 0.2, 0.001) << "blue";
  }
}

TEST(Converter, RefusesShortBuffers) {
  const Encoding& encoding = *encoding_of(V4L2_PIX_FMT_GREY);
  const Layout l = layout(V4L2_PIX_FMT_GREY, 16, 6, 16, 96);
  std::vector<std::byte> driver(96), picture(l.picture_bytes);
  Converter converter(encoding, l);
  EXPECT_TRUE(converter.convert(driver, picture));
  EXPECT_FALSE(converter.convert(std::span(driver).first(95), picture));
  EXPECT_FALSE(converter.convert(driver, std::span(picture).first(picture.size() - 1)));
}

TEST(MeanLevel, IsTheLevelOfAUniformPicture) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_SRGGB8, V4L2_PIX_FMT_SRGGB10}) {
    const Layout l = layout(fourcc, 64, 48, 0, 64 * 48 * 2);
    std::vector<std::byte> driver(l.picture_bytes);
    test::draw_picture(fourcc, 64, 48, l.stride, 0.8, 0, driver);
    // Mean of red, two greens and blue: (0.8 + 2 * 0.4 + 0.2) / 4.
    EXPECT_NEAR(mean_level(view_of(*encoding_of(fourcc), l, driver)), 0.45, 0.01) << fourcc_text(fourcc);
  }
  EXPECT_EQ(mean_level(View{}), 0);
}

}  // namespace
}  // namespace lightwell::v4l2
