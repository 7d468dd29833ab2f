#include <cmath>

#include <gtest/gtest.h>

#include "imaging/jpeg_decoder.hpp"
#include "usb_camera/scene_source.hpp"

namespace lightwell::usb_camera {
namespace {

std::vector<std::byte> ramp(FrameSize size, bool noisy) {
  std::vector<std::byte> rgb;
  unsigned random = 1;
  for (int j = 0; j < size.height; ++j) {
    for (int i = 0; i < size.width; ++i) {
      for (int c = 0; c < 3; ++c) {
        random = random * 1664525 + 1013904223;
        rgb.push_back(static_cast<std::byte>(noisy ? random >> 24 : static_cast<unsigned>(i + j + 20 * c)));
      }
    }
  }
  return rgb;
}

TEST(JpegEncoder, DecodesToNearlyTheSameImage) {
  const FrameSize size{96, 64};
  const std::vector<std::byte> rgb = ramp(size, false);
  const auto jpeg = encode_mjpeg(rgb, size, 90, 1 << 20);
  ASSERT_TRUE(jpeg) << jpeg.status().message();
  std::vector<std::byte> back(rgb.size());
  JpegDecoder decoder;
  ASSERT_TRUE(decoder.decode_frame(*jpeg, size.width, size.height, back));
  double sum = 0;
  for (std::size_t k = 0; k < rgb.size(); ++k)
    sum += std::abs(static_cast<double>(rgb[k]) - static_cast<double>(back[k]));
  EXPECT_LT(sum / static_cast<double>(rgb.size()), 2);
  ASSERT_TRUE(decoder.decode_frame(*stamped(std::make_shared<const std::vector<std::byte>>(*jpeg), Encoding::mjpeg, 99),
                                   size.width, size.height, back))
      << "a stamped image can be decoded";
}

TEST(JpegEncoder, LowersTheQualityUntilItFits) {
  const FrameSize size{96, 64};
  const std::vector<std::byte> noise = ramp(size, true);
  const auto large = encode_mjpeg(noise, size, 95, 1 << 20);
  ASSERT_TRUE(large);
  const std::size_t most = large->size() / 2;
  const auto small = encode_mjpeg(noise, size, 95, most);
  ASSERT_TRUE(small);
  EXPECT_LE(small->size(), most);
  EXPECT_FALSE(encode_mjpeg(noise, size, 95, 100));
}

TEST(JpegEncoder, ReportsErrorsOfTheEncoder) {
  const auto none = encode_mjpeg({}, {0, 0}, 90, 1000);
  EXPECT_FALSE(none);
  EXPECT_NE(none.status().message().find("JPEG"), std::string::npos);
}

}  // namespace
}  // namespace lightwell::usb_camera
