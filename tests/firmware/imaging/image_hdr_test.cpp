#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "imaging/image_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;

std::array<float, 3> pixel(const Image& image, int x, int y) {
  std::array<float, 3> rgb{};
  std::memcpy(rgb.data(),
              image.data.data() + image.stride() * static_cast<std::size_t>(y) + 12 * static_cast<std::size_t>(x), 12);
  return rgb;
}

class ImageHdr : public ::testing::Test {
 protected:
  Result<Image> read(const std::string& text) { return read_image(scratch.write("x.hdr", std::string_view(text))); }
  test::TempDir scratch;
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
};

TEST_F(ImageHdr, FlatPixelsAreMantissaAndAHalfTimesPowerOfTwo) {
  const auto image = read(head + "-Y 1 +X 2\n" + std::string("\x80\x40\x00\x81", 4) + std::string(4, '\0'));
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_EQ(image->format, PixelFormat::rgb_f32);
  EXPECT_FLOAT_EQ(pixel(*image, 0, 0)[0], 128.5F / 128);
  EXPECT_FLOAT_EQ(pixel(*image, 0, 0)[1], 64.5F / 128);
  EXPECT_FLOAT_EQ(pixel(*image, 0, 0)[2], 0.5F / 128);
  EXPECT_EQ(pixel(*image, 1, 0), (std::array<float, 3>{}));
}

TEST_F(ImageHdr, ExposuresAreDividedOut) {
  const auto image =
      read("#?RGBE\nEXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR= 1 2 1\n\n-Y 1 +X 1\n" + std::string("\x80\x80\x80\x81", 4));
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_FLOAT_EQ(pixel(*image, 0, 0)[0], 128.5F / 128 / 8);
  EXPECT_FLOAT_EQ(pixel(*image, 0, 0)[1], 128.5F / 128 / 16);
}

TEST_F(ImageHdr, OldRunsRepeatThePreviousPixel) {
  const std::string p("\x80\x40\x20\x80", 4);
  const auto image = read(head + "-Y 1 +X 264\n" + p + "\x01\x01\x01\x05" + std::string("\x01\x01\x01\x01", 4) +
                          std::string("\x10\x20\x30\x80\x90\x20\x30\x80", 8));
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_EQ(pixel(*image, 0, 0), pixel(*image, 261, 0));
  EXPECT_NE(pixel(*image, 261, 0), pixel(*image, 262, 0));
  EXPECT_FLOAT_EQ(pixel(*image, 263, 0)[0], 144.5F / 256);
}

/// A picture for OpenCV's writer, which uses the new run-length encoding.
cv::Mat picture() {
  cv::Mat m(13, 50, CV_32FC3, cv::Scalar(0.5, 2, 700));
  cv::theRNG().state = 3;
  cv::randu(m.colRange(20, 35), 0, 9);
  return m;
}
std::vector<std::byte> file_of(const cv::Mat& m) {
  std::vector<unsigned char> bytes;
  EXPECT_TRUE(cv::imencode(".hdr", m, bytes));
  std::vector<std::byte> out(bytes.size());
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

TEST_F(ImageHdr, NewRunsGiveWhatOpenCvWroteWithinHalfAMantissaStep) {
  const cv::Mat m = picture();
  const auto image = read_image(scratch.write("cv.hdr", file_of(m)));
  ASSERT_TRUE(image.ok()) << image.status().message();
  for (int y = 0; y < m.rows; ++y)
    for (int x = 0; x < m.cols; ++x) {
      const auto bgr = m.at<cv::Vec3f>(y, x);
      const float step = std::max({bgr[0], bgr[1], bgr[2]}) / 128;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(pixel(*image, x, y)[static_cast<std::size_t>(c)], bgr[2 - c], 0.51F * step) << x << ' ' << y;
    }
}

TEST_F(ImageHdr, TruncationAtAnyLengthIsDataLoss) {
  const auto whole = file_of(picture());
  for (std::size_t n = 12; n < whole.size(); ++n) {
    const auto image = read_image(scratch.write("cut.hdr", std::span(whole).first(n)));
    ASSERT_FALSE(image.ok()) << n;
    ASSERT_EQ(image.status().code(), StatusCode::data_loss) << n << ' ' << image.status().message();
  }
}

TEST_F(ImageHdr, DamagedRunsAreDetected) {
  const std::string size = "-Y 1 +X 8\n";
  for (const std::string& row : {
           std::string("\x02\x02\x00\x09", 4) + std::string(40, '\x88'),  // Another length.
           std::string("\x02\x02\x00\x08\x89\x10", 6),                    // A run beyond the row.
           std::string("\x02\x02\x00\x08\x00", 5),                        // A count of nothing.
           std::string("\x01\x01\x01\x08", 4),                            // Repeats nothing.
           std::string("\x10\x10\x10\x80\x01\x01\x01\x09", 8),            // Repeats beyond the row.
           std::string(32, '\x40') + "x",                                 // More than the picture.
       }) {
    const auto image = read(head + size + row);
    EXPECT_EQ(image.status().code(), StatusCode::data_loss) << image.status().message();
  }
}

TEST_F(ImageHdr, OtherOrientationsColoursAndSizesAreRefused) {
  for (const char* line : {"+Y 1 +X 1\n", "+X 1 -Y 1\n", "-Y 1 -X 1\n", "-Y 0 +X 1\n", "-Y x +X 1\n", "-Y 1 +X 1 \n",
                           "-Y 99999999 +X 99999999\n", "-Y 65536 +X 65536\n"})
    EXPECT_EQ(read(head + line + "abcd").status().code(), StatusCode::invalid_argument) << line;
  const auto xyz = read("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd");
  EXPECT_EQ(xyz.status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(xyz.status().message(), HasSubstr("ra_xyze"));
  EXPECT_EQ(read("#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\nabcd").status().code(), StatusCode::data_loss);
}

TEST_F(ImageHdr, HugeSizeInATinyFileAllocatesNoMemory) {
  const auto image = read(head + "-Y 8192 +X 8192\nabcd");
  EXPECT_EQ(image.status().code(), StatusCode::data_loss);
}

}  // namespace
}  // namespace lightwell
