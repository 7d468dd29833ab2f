#include <gtest/gtest.h>

#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {
namespace {

Picture plain(std::size_t n) { return std::make_shared<const std::vector<std::byte>>(n, std::byte{1}); }

std::uint64_t read(const std::vector<std::byte>& picture, std::size_t step) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 16; ++i)
    number |= static_cast<std::uint64_t>(static_cast<unsigned>(picture[i * step]) >> 4) << (4 * i);
  return number;
}

TEST(FrameStamp, IsInTheLumaOfTheFirstPixels) {
  constexpr std::uint64_t kNumber = 0x0123456789ABCDEF;
  const Picture before = plain(200);
  EXPECT_EQ(read(*stamped(before, Encoding::yuyv, kNumber), 2), kNumber);
  EXPECT_EQ(read(*stamped(before, Encoding::nv12, kNumber), 1), kNumber);
  const Picture after = stamped(before, Encoding::yuyv, kNumber);
  for (std::size_t i = 0; i < 200; ++i) {
    if (i >= 32 || i % 2 == 1) {
      EXPECT_EQ((*after)[i], std::byte{1}) << i;
    }
  }
  EXPECT_EQ((*before)[0], std::byte{1}) << "the original is shared and must not change";
}

TEST(FrameStamp, IsACommentInAJpeg) {
  auto jpeg = std::make_shared<std::vector<std::byte>>(std::vector{std::byte{0xFF}, std::byte{0xD8}, std::byte{0xFF}});
  const Picture after = stamped(jpeg, Encoding::mjpeg, 0x0201);
  ASSERT_EQ(after->size(), 3 + 12U);
  EXPECT_EQ((*after)[1], std::byte{0xD8});
  EXPECT_EQ((*after)[3], std::byte{0xFE});
  EXPECT_EQ((*after)[5], std::byte{10});
  EXPECT_EQ((*after)[6], std::byte{1});
  EXPECT_EQ((*after)[7], std::byte{2});
  EXPECT_EQ(after->back(), std::byte{0xFF});
}

}  // namespace
}  // namespace lightwell::usb_camera
