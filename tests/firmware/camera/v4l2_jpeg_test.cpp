// Motion JPEG: whole pictures or none.
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "camera/backends/v4l2/jpeg_decoder.hpp"
#include "firmware/camera/v4l2_picture.hpp"

namespace lightwell::v4l2 {
namespace {

constexpr int kWidth = 64, kHeight = 48;

class Jpeg : public ::testing::Test {
 protected:
  bool decodes(std::span<const std::byte> jpeg) { return decoder_.decode(jpeg, rgb_); }
  int red(int x, int y) const { return std::to_integer<int>(rgb_[static_cast<std::size_t>(3 * (y * kWidth + x))]); }

  JpegDecoder decoder_{kWidth, kHeight};
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
      << "the tables are really left out";
}

TEST_F(Jpeg, CutOffAnywhereItIsNoPicture) {
  const std::vector<std::byte> whole = test::draw_jpeg(kWidth, kHeight, 90, 5, true);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(decodes(std::span(whole).first(size))) << size << " of " << whole.size();
  EXPECT_TRUE(decodes(whole)) << "and the decoder works on";
}

TEST_F(Jpeg, OfAnotherSizeItIsNoPicture) {
  EXPECT_FALSE(decodes(test::draw_jpeg(kWidth - 16, kHeight, 90, 0, true)));
  EXPECT_FALSE(decodes(test::draw_jpeg(kWidth, kHeight + 16, 90, 0, true)));
  EXPECT_FALSE(decodes(test::draw_jpeg(2 * kWidth, 2 * kHeight, 90, 0, true)));
}

TEST_F(Jpeg, PaddingOfAByteIsForgivenAndAMissingScanIsNot) {
  std::vector<std::byte> padded = test::draw_jpeg(kWidth, kHeight, 90, 5, true);
  padded.insert(padded.end() - 2, 2, std::byte{0});
  EXPECT_TRUE(decodes(padded));
  padded.insert(padded.end() - 2, 40, std::byte{0});
  EXPECT_FALSE(decodes(padded));
}

TEST_F(Jpeg, NoiseIsNoPicture) {
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::byte> noise = test::draw_jpeg(kWidth, kHeight, 90, 5, true);
    // The headers are torn, not the pixels: whether those are broken nobody can tell.
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
  EXPECT_FALSE(decoder_.decode(test::draw_jpeg(kWidth, kHeight, 90, 5, true), small));
  EXPECT_TRUE(std::ranges::all_of(small, [](std::byte b) { return b == std::byte{7}; }));
}

}  // namespace
}  // namespace lightwell::v4l2
