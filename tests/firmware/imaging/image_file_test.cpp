// Tests of PNG and JPEG, and of behaviour common to all formats. EXR and HDR: image_exr_test.cpp, image_hdr_test.cpp.
#include "imaging/image_file.hpp"

#include <algorithm>
#include <png.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;

std::vector<std::byte> encoded(const char* extension, const cv::Mat& m, const std::vector<int>& options = {}) {
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
  return std::to_integer<int>(
      image.data[image.stride() * static_cast<std::size_t>(y) + static_cast<std::size_t>(3 * x + channel)]);
}

class ImageFile : public ::testing::Test {
 protected:
  Status status_of(std::span<const std::byte> bytes) { return read_image(scratch.write("x", bytes)).status(); }
  test::TempDir scratch;
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

TEST_F(ImageFile, JpegIsApproximateAndInTheOrderRedGreenBlue) {
  const auto image = read_image(scratch.write("j", encoded(".jpg", cv::Mat(16, 16, CV_8UC3, cv::Scalar(10, 60, 220)))));
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
  // APP1 with one TIFF entry: orientation 6, rotate clockwise.
  const unsigned char exif[] = {0xFF, 0xE1, 0,    34, 'E', 'x', 'i', 'f', 0, 0, 'I', 'I', 42, 0, 8, 0, 0, 0,
                                1,    0,    0x12, 1,  3,   0,   1,   0,   0, 0, 6,   0,   0,  0, 0, 0, 0, 0};
  const auto bytes = std::as_bytes(std::span(exif));
  jpeg.insert(jpeg.begin() + 2, bytes.begin(), bytes.end());
  const auto image = read_image(scratch.write("e", jpeg));
  ASSERT_TRUE(image.ok()) << image.status().message();
  EXPECT_EQ(image->width, 40);
  EXPECT_EQ(image->height, 24);
}

/// A PNG with a palette of 4 colours at 2 bits, interlaced, with a gamma that is not sRGB's; written with plain libpng.
std::vector<std::byte> palette_interlaced_linear(int width, int height) {
  std::vector<std::byte> file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &file,
      [](png_structp p, png_bytep from, std::size_t n) {
        const auto bytes = std::as_bytes(std::span(from, n));
        auto& to = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(p));
        to.insert(to.end(), bytes.begin(), bytes.end());
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 2, PNG_COLOR_TYPE_PALETTE,
               PNG_INTERLACE_ADAM7, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  const png_color colors[] = {{10, 20, 30}, {40, 50, 60}, {70, 80, 90}, {200, 210, 220}};
  png_set_PLTE(png, info, colors, 4);
  png_set_gAMA(png, info, 1.0);
  png_write_info(png, info);
  png_set_packing(png);
  const int passes = png_set_interlace_handling(png);
  std::vector<png_byte> row(static_cast<std::size_t>(width));
  for (int pass = 0; pass < passes; ++pass)
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] = static_cast<png_byte>((x + y) % 4);
      png_write_row(png, row.data());
    }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return file;
}

TEST_F(ImageFile, PaletteAndInterlacedPngAreReadAndTheirGammaIsNotApplied) {
  const auto image = read_image(scratch.write("p", palette_interlaced_linear(13, 9)));
  ASSERT_TRUE(image.ok()) << image.status().message();
  ASSERT_EQ(image->width, 13);
  ASSERT_EQ(image->height, 9);
  const int colors[4][3] = {{10, 20, 30}, {40, 50, 60}, {70, 80, 90}, {200, 210, 220}};
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 13; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(value(*image, x, y, c), colors[(x + y) % 4][c]) << x << ' ' << y << ' ' << c;
}

TEST_F(ImageFile, OneBitIsBlackOrWhite) {
  cv::Mat two(5, 11, CV_8UC1, cv::Scalar(0));
  two.at<unsigned char>(3, 7) = 255;
  const auto image = read_image(scratch.write("b", encoded(".png", two, {cv::IMWRITE_PNG_BILEVEL, 1})));
  ASSERT_TRUE(image.ok()) << image.status().message();
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(value(*image, 7, 3, c), 255);
    EXPECT_EQ(value(*image, 6, 3, c), 0);
  }
}

/// Compatibility with OpenCV's independent encoder and decoder.
TEST_F(ImageFile, OpenCvReadsWhatIsWrittenAndIsReadWithTheSameValues) {
  const cv::Mat bgr = noise(CV_8UC3);
  for (const char* kind : {".png", ".jpg"}) {
    const auto file = encoded(kind, bgr);
    const auto ours = read_image(scratch.write("o", file));
    ASSERT_TRUE(ours.ok()) << ours.status().message();
    const cv::Mat theirs = cv::imread(scratch.path("o"), cv::IMREAD_COLOR);
    for (int y = 0; y < bgr.rows; ++y)
      for (int x = 0; x < bgr.cols; ++x)
        for (int c = 0; c < 3; ++c)
          ASSERT_EQ(value(*ours, x, y, c), theirs.at<cv::Vec3b>(y, x)[2 - c]) << kind << x << ' ' << y;
    ASSERT_TRUE(write_png(scratch.path("w.png"), *ours).ok());
    const cv::Mat again = cv::imread(scratch.path("w.png"), cv::IMREAD_COLOR);
    EXPECT_EQ(cv::norm(again, theirs, cv::NORM_INF), 0) << kind;
  }
}

TEST_F(ImageFile, InvalidCodesInAJpegAreDetectedWithoutConsoleOutput) {
  auto damaged = encoded(".jpg", noise(CV_8UC3));
  // All ones is not a Huffman code; each FF is followed by a stuffed zero, so that it is not a marker.
  for (std::size_t i = damaged.size() / 2; i + 40 < damaged.size(); i += 2) {
    damaged[i] = std::byte{0xFF};
    damaged[i + 1] = std::byte{0};
  }
  ::testing::internal::CaptureStderr();
  const Status status = status_of(damaged);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(status.code(), StatusCode::data_loss) << status.message();
}

TEST_F(ImageFile, AJpegWhosePixelsEndBeforeItsCodesIsDamaged) {
  auto longer = encoded(".jpg", noise(CV_8UC3));
  ASSERT_TRUE(status_of(longer).ok());
  // Insert before the end marker more codes than the picture has pixels, as a changed bit may cause.
  longer.insert(longer.end() - 2, 32, std::byte{0x55});
  const Status status = status_of(longer);
  EXPECT_EQ(status.code(), StatusCode::data_loss) << status.message();
}

TEST_F(ImageFile, TruncationAtAnyLengthIsDataLoss) {
  for (const char* kind : {".png", ".jpg"}) {
    const auto whole = encoded(kind, noise(CV_8UC3));
    for (std::size_t n = 0; n < whole.size(); n += n < 64 || n + 64 > whole.size() ? 1 : 29) {
      const Status status = status_of(std::span(whole).first(n));
      ASSERT_FALSE(status.ok()) << kind << " of " << n << " bytes";
      // Two or three bytes are too few to recognise the format.
      if (n >= 4 || n == 0) {
        ASSERT_EQ(status.code(), StatusCode::data_loss) << n << status.message();
      }
    }
  }
}

TEST_F(ImageFile, ProgressiveJpegIsReadAndTruncationIsDetected) {
  const auto whole = encoded(".jpg", noise(CV_8UC3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_TRUE(status_of(whole).ok());
  EXPECT_EQ(status_of(std::span(whole).first(whole.size() - 2)).code(), StatusCode::data_loss);
  EXPECT_EQ(status_of(std::span(whole).first(whole.size() / 2)).code(), StatusCode::data_loss);
}

TEST_F(ImageFile, AnyFlippedBitOfAPngIsDetected) {
  const auto whole = encoded(".png", noise(CV_8UC3));
  for (std::size_t i = 0; i < whole.size(); i += i < 64 ? 1 : 97) {
    auto damaged = whole;
    damaged[i] ^= std::byte{0x10};
    EXPECT_FALSE(status_of(damaged).ok()) << "byte " << i;
  }
}

TEST_F(ImageFile, PrematureEndOfAJpegIsDetected) {
  auto early = encoded(".jpg", noise(CV_8UC3));
  early[early.size() / 2] = std::byte{0xFF};
  early[early.size() / 2 + 1] = std::byte{0xD9};
  const Status status = status_of(early);
  EXPECT_EQ(status.code(), StatusCode::data_loss) << status.message();
}

TEST_F(ImageFile, ASecondPictureOrPaddingAfterAJpegIsAccepted) {
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

TEST_F(ImageFile, FailureToWriteAPngIsReported) {
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
