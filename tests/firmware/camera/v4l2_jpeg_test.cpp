// Tests of JpegDecoder::decode_frame(): complete pictures are decoded, others refused.
#include <algorithm>
#include <cstdio>
#include <jpeglib.h>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "firmware/camera/v4l2_picture.hpp"
#include "imaging/jpeg_decoder.hpp"

namespace lightwell {
namespace {

constexpr int kWidth = 64, kHeight = 48;

class Jpeg : public ::testing::Test {
 protected:
  bool decodes(std::span<const std::byte> jpeg) { return decoder_.decode_frame(jpeg, kWidth, kHeight, rgb_); }
  int red(int x, int y) const { return std::to_integer<int>(rgb_[static_cast<std::size_t>(3 * (y * kWidth + x))]); }

  JpegDecoder decoder_;
  std::vector<std::byte> rgb_ = std::vector<std::byte>(3 * kWidth * kHeight);
};

TEST_F(Jpeg, IsDecodedWithAndWithoutItsTables) {
  for (const bool with_tables : {true, false}) {
    ASSERT_TRUE(decodes(test::draw_jpeg(kWidth, kHeight, 200, 0, with_tables)));
    EXPECT_NEAR(red(0, 0), 200, 2);
    EXPECT_NEAR(red(40, 20), 200, 2);
  }
  ASSERT_LT(test::draw_jpeg(kWidth, kHeight, 200, 0, false).size() + 300,
            test::draw_jpeg(kWidth, kHeight, 200, 0, true).size())
      << "the tables must be missing";
}

/// Decodes with plain libjpeg and its own memory manager.
std::vector<std::byte> reference(std::span<const std::byte> jpeg) {
  jpeg_decompress_struct state{};
  jpeg_error_mgr errors{};
  state.err = jpeg_std_error(&errors);
  jpeg_create_decompress(&state);
  jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(jpeg.data()), static_cast<unsigned long>(jpeg.size()));
  jpeg_read_header(&state, TRUE);
  state.out_color_space = JCS_RGB;
  jpeg_start_decompress(&state);
  const std::size_t stride = 3 * static_cast<std::size_t>(state.output_width);
  std::vector<std::byte> rgb(stride * state.output_height);
  while (state.output_scanline < state.output_height) {
    auto* row = reinterpret_cast<JSAMPROW>(rgb.data() + stride * state.output_scanline);
    jpeg_read_scanlines(&state, &row, 1);
  }
  jpeg_destroy_decompress(&state);
  return rgb;
}

TEST(JpegDecoder, IsBitIdenticalToLibjpegForAnyContentAndSize) {
  std::mt19937 random(3);
  // Includes sizes that do not fill their blocks, and chroma at half, quarter and full resolution.
  for (const auto& [width, height] : {std::pair{64, 48}, {70, 50}, {2, 2}, {333, 17}}) {
    JpegDecoder decoder;
    std::vector<std::byte> rgb(static_cast<std::size_t>(3 * width * height));
    for (int i = 0; i < 12; ++i) {
      const std::vector<std::byte> jpeg =
          test::draw_noise_jpeg(width, height, static_cast<unsigned>(random()), 1 + i % 2, 1 + i / 2 % 2);
      ASSERT_TRUE(decoder.decode_frame(jpeg, width, height, rgb)) << width << "x" << height << " picture " << i;
      EXPECT_EQ(rgb, reference(jpeg)) << width << "x" << height << " picture " << i;
      // A truncated picture in between does not affect later ones.
      EXPECT_FALSE(decoder.decode_frame(std::span(jpeg).first(jpeg.size() * 2 / 3), width, height, rgb));
    }
  }
}

TEST_F(Jpeg, RefusesTruncationAtAnyLength) {
  const std::vector<std::byte> whole = test::draw_jpeg(kWidth, kHeight, 90, 5, true);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(decodes(std::span(whole).first(size))) << size << " of " << whole.size();
  EXPECT_TRUE(decodes(whole)) << "the decoder must still work";
}

TEST_F(Jpeg, RefusesAnotherSize) {
  EXPECT_FALSE(decodes(test::draw_jpeg(kWidth - 16, kHeight, 90, 0, true)));
  EXPECT_FALSE(decodes(test::draw_jpeg(kWidth, kHeight + 16, 90, 0, true)));
  EXPECT_FALSE(decodes(test::draw_jpeg(2 * kWidth, 2 * kHeight, 90, 0, true)));
}

TEST_F(Jpeg, AcceptsAByteOfPaddingButNotAMissingScan) {
  std::vector<std::byte> padded = test::draw_jpeg(kWidth, kHeight, 90, 5, true);
  padded.insert(padded.end() - 2, 2, std::byte{0});
  EXPECT_TRUE(decodes(padded));
  padded.insert(padded.end() - 2, 40, std::byte{0});
  EXPECT_FALSE(decodes(padded));
}

TEST_F(Jpeg, RefusesNoise) {
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::byte> noise = test::draw_jpeg(kWidth, kHeight, 90, 5, true);
    // Damage the headers only: damaged pixels cannot always be detected.
    const std::size_t at = random() % 20;
    noise[at] ^= static_cast<std::byte>(1 + random() % 255);
    noise.resize(noise.size() - random() % 40);
    (void)decodes(noise);
  }
  std::vector<std::byte> nothing(5000);
  EXPECT_FALSE(decodes(nothing));
  std::ranges::generate(nothing, [&] { return static_cast<std::byte>(random()); });
  EXPECT_FALSE(decodes(nothing));
  EXPECT_FALSE(decodes({}));
}

TEST_F(Jpeg, MemoryThatIsTooSmallIsNotWrittenTo) {
  std::vector<std::byte> small(rgb_.size() - 1, std::byte{7});
  EXPECT_FALSE(decoder_.decode_frame(test::draw_jpeg(kWidth, kHeight, 90, 5, true), kWidth, kHeight, small));
  EXPECT_TRUE(std::ranges::all_of(small, [](std::byte b) { return b == std::byte{7}; }));
}

}  // namespace
}  // namespace lightwell
