// PNG and JPEG, and what is common to all kinds. EXR and HDR: image_exr_test.cpp,
// image_hdr_test.cpp.
#include "camera/image_file.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "firmware/camera/scratch.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;

std::vector<std::byte> encoded(const char* extension, const cv::Mat& m,
                               const std::vector<int>& options = {}) {
  std::vector<unsigned char> bytes;
  EXPECT_TRUE(cv::imencode(extension, m, bytes, options));
  std::vector<std::byte> out(bytes.size());
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

cv::Mat noise(int type) {
  cv::Mat m(24, 40, type);
  cv::theRNG().state = 7;
  cv::randu(m, 0, 255);
  return m;
}

int value(const Image& image, int x, int y, int channel) {
  return std::to_integer<int>(image.data[image.stride() * static_cast<std::size_t>(y) +
                                         static_cast<std::size_t>(3 * x + channel)]);
}

class ImageFile : public ::testing::Test {
 protected:
  Status status_of(std::span<const std::byte> bytes) {
    return read_image(scratch.write("x", bytes)).status();
  }
  Scratch scratch;
};

TEST_F(ImageFile, PngComesBackAsWrittenInTheOrderRedGreenBlue) {
  Image image{3, 2, PixelFormat::rgb8, {}};
  for (int i = 0; i < 18; ++i) image.data.push_back(std::byte(i * 13));
  ASSERT_TRUE(write_png(scratch.path("a.png"), image).ok());
  const auto back = read_image(scratch.path("a.png"));
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(back->width, 3);
  EXPECT_EQ(back->height, 2);
  EXPECT_EQ(back->format, PixelFormat::rgb8);
  EXPECT_EQ(back->data, image.data);
}

TEST_F(ImageFile, JpegIsNearAndItsRedIsRed) {
  const auto image = read_image(
      scratch.write("j", encoded(".jpg", cv::Mat(16, 16, CV_8UC3, cv::Scalar(10, 60, 220)))));
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_NEAR(value(*image, 5, 5, 0), 220, 4);
  EXPECT_NEAR(value(*image, 5, 5, 1), 60, 4);
  EXPECT_NEAR(value(*image, 5, 5, 2), 10, 4);
}

TEST_F(ImageFile, GreyIsExpanded) {
  const cv::Mat grey = noise(CV_8UC1);
  const auto png = read_image(scratch.write("g", encoded(".png", grey)));
  ASSERT_TRUE(png.ok()) << png.status().message();
  for (int c = 0; c < 3; ++c) EXPECT_EQ(value(*png, 7, 3, c), grey.at<unsigned char>(3, 7));
  EXPECT_TRUE(status_of(encoded(".jpg", grey)).ok());
}

TEST_F(ImageFile, SixteenBitsAndAlphaAreRefusedWithTheRemedy) {
  const Status deep = status_of(encoded(".png", noise(CV_16UC3)));
  EXPECT_EQ(deep.code(), StatusCode::invalid_argument);
  EXPECT_THAT(deep.message(), HasSubstr("16 bits a channel; convert it to 8"));
  const Status alpha = status_of(encoded(".png", noise(CV_8UC4)));
  EXPECT_EQ(alpha.code(), StatusCode::invalid_argument);
  EXPECT_THAT(alpha.message(), HasSubstr("without alpha"));
}

TEST_F(ImageFile, ExifOrientationDoesNotTurnThePicture) {
  auto jpeg = encoded(".jpg", noise(CV_8UC3));
  // APP1 with one TIFF entry: orientation 6, "turn right".
  const unsigned char exif[] = {0xFF, 0xE1, 0, 34, 'E', 'x', 'i', 'f', 0,    0, 'I', 'I',
                                42,   0,    8, 0,  0,   0,   1,   0,   0x12, 1, 3,   0,
                                1,    0,    0, 0,  6,   0,   0,   0,   0,    0, 0,   0};
  const auto bytes = std::as_bytes(std::span(exif));
  jpeg.insert(jpeg.begin() + 2, bytes.begin(), bytes.end());
  const auto image = read_image(scratch.write("e", jpeg));
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_EQ(image->width, 40);
  EXPECT_EQ(image->height, 24);
}

TEST_F(ImageFile, CutOffAtAnyLengthIsDataLoss) {
  for (const char* kind : {".png", ".jpg"}) {
    const auto whole = encoded(kind, noise(CV_8UC3));
    for (std::size_t n = 0; n < whole.size(); n += n < 64 || n + 64 > whole.size() ? 1 : 29) {
      const Status status = status_of(std::span(whole).first(n));
      ASSERT_FALSE(status.ok()) << kind << " of " << n << " bytes";
      // Two or three bytes are not yet a kind of picture.
      if (n >= 4 || n == 0) {
        ASSERT_EQ(status.code(), StatusCode::data_loss) << n << status.message();
      }
    }
  }
}

TEST_F(ImageFile, ProgressiveJpegIsReadAndCutOffIsSeen) {
  const auto whole = encoded(".jpg", noise(CV_8UC3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_TRUE(status_of(whole).ok());
  EXPECT_EQ(status_of(std::span(whole).first(whole.size() - 2)).code(), StatusCode::data_loss);
  EXPECT_EQ(status_of(std::span(whole).first(whole.size() / 2)).code(), StatusCode::data_loss);
}

TEST_F(ImageFile, AnyFlippedBitOfAPngIsSeen) {
  const auto whole = encoded(".png", noise(CV_8UC3));
  for (std::size_t i = 0; i < whole.size(); i += i < 64 ? 1 : 97) {
    auto damaged = whole;
    damaged[i] ^= std::byte{0x10};
    EXPECT_FALSE(status_of(damaged).ok()) << "byte " << i;
  }
}

TEST_F(ImageFile, JpegWhoseEndComesEarlyIsSeen) {
  auto early = encoded(".jpg", noise(CV_8UC3));
  early[early.size() / 2] = std::byte{0xFF};
  early[early.size() / 2 + 1] = std::byte{0xD9};
  const Status status = status_of(early);
  EXPECT_EQ(status.code(), StatusCode::data_loss) << status.message();
}

TEST_F(ImageFile, SecondPictureOrPaddingBehindAJpegIsNoDamage) {
  const auto one = encoded(".jpg", noise(CV_8UC3));
  auto both = one;
  both.insert(both.end(), one.begin(), one.end());
  EXPECT_TRUE(status_of(both).ok());
  auto padded = one;
  padded.resize(padded.size() + 64);
  EXPECT_TRUE(status_of(padded).ok());
}

TEST_F(ImageFile, EveryErrorNamesTheFile) {
  const std::string path = scratch.write("not_a_picture.png", std::string_view("hello, world"));
  const auto text = read_image(path);
  EXPECT_EQ(text.status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(text.status().message(), HasSubstr(path));
  const auto missing = read_image(scratch.path("missing.png"));
  EXPECT_EQ(missing.status().code(), StatusCode::not_found);
  EXPECT_THAT(missing.status().message(), HasSubstr("missing.png"));
  EXPECT_EQ(read_image(scratch.path("")).status().code(), StatusCode::invalid_argument);
}

TEST_F(ImageFile, PngThatCannotBeWrittenIsSaid) {
  Image image{64, 64, PixelFormat::rgb8, std::vector<std::byte>(64 * 64 * 3)};
  EXPECT_EQ(write_png("/dev/full", image).code(), StatusCode::resource_exhausted);
  EXPECT_EQ(write_png(scratch.path("no/folder.png"), image).code(), StatusCode::not_found);
  image.data.pop_back();
  EXPECT_EQ(write_png(scratch.path("short.png"), image).code(), StatusCode::invalid_argument);
  image.format = PixelFormat::rgb_f32;
  EXPECT_EQ(write_png(scratch.path("float.png"), image).code(), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell
