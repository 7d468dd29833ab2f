// JPEG encoding, decoded again by OpenCV's own reader.
#include "imaging/jpeg_encoder.hpp"

#include <cstdlib>
#include <span>
#include <tuple>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "imaging/image_file.hpp"

namespace lightwell {
namespace {

Image gradient(int width, int height) {
  Image image{width, height, PixelFormat::rgb8, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const int v : {255 * x / width, 255 * y / height, 100}) image.data.push_back(static_cast<std::byte>(v));
  return image;
}

TEST(JpegEncoder, AnotherDecoderReadsThePicture) {
  for (const auto& [width, height, chroma] : {std::tuple{320, 160, ChromaSampling::yuv420},
                                              {317, 159, ChromaSampling::yuv420},
                                              {1, 1, ChromaSampling::yuv420},
                                              {320, 1, ChromaSampling::yuv420},
                                              {317, 159, ChromaSampling::yuv422}}) {
    const Image image = gradient(width, height);
    const Result<std::vector<std::byte>> jpeg =
        encode_jpeg(image.data, width, height, {.quality = 90, .chroma = chroma});
    ASSERT_TRUE(jpeg.ok()) << jpeg.status().message();
    const cv::Mat bytes(1, static_cast<int>(jpeg->size()), CV_8U, const_cast<std::byte*>(jpeg->data()));
    const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_COLOR);
    ASSERT_EQ(decoded.cols, width);
    ASSERT_EQ(decoded.rows, height);
    for (int y = 0; y < height; y += 7)
      for (int x = 0; x < width; x += 7) {
        const auto bgr = decoded.at<cv::Vec3b>(y, x);
        // Chroma has half the resolution, and its gradient is a code a pixel.
        EXPECT_NEAR(bgr[2], 255 * x / width, 6) << x << " " << y;
        EXPECT_NEAR(bgr[1], 255 * y / height, 6) << x << " " << y;
        EXPECT_NEAR(bgr[0], 100, 8) << x << " " << y;
      }
  }
}

TEST(JpegEncoder, NoiseAtFullQualityFits) {
  Image image = gradient(320, 160);
  std::srand(1);
  for (std::byte& v : image.data) v = static_cast<std::byte>(std::rand());
  const Result<std::vector<std::byte>> jpeg = encode_jpeg(image.data, image.width, image.height, {.quality = 100});
  ASSERT_TRUE(jpeg.ok()) << jpeg.status().message();
  EXPECT_GT(jpeg->size(), 50'000U);
}

TEST(JpegEncoder, OtherSizesAreRefused) {
  const Image image = gradient(4, 4);
  const auto code = [&](std::size_t bytes, int width, int height) {
    return encode_jpeg(std::span(image.data).first(bytes), width, height, {}).status().code();
  };
  EXPECT_EQ(code(48, 4, 4), StatusCode::ok);
  EXPECT_EQ(code(47, 4, 4), StatusCode::invalid_argument) << "cut";
  EXPECT_EQ(code(48, 3, 4), StatusCode::invalid_argument) << "too many";
  EXPECT_EQ(code(0, 0, 0), StatusCode::invalid_argument);
  EXPECT_EQ(code(48, -4, -4), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell
