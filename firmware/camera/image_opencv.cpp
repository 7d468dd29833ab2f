// Decoding and encoding through OpenCV; what it lets pass, image_png.cpp and image_jpeg.cpp look at
// first.
#include <algorithm>
#include <cstring>
#include <exception>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "camera/image_readers.hpp"

namespace lightwell {
namespace {

/// One row of r, g, b from b, g, r or the reverse.
void swap_red_blue(const std::byte* from, std::byte* to, int width) {
  for (int i = 0; i < width; ++i, from += 3, to += 3) {
    to[0] = from[2];
    to[1] = from[1];
    to[2] = from[0];
  }
}

}  // namespace

Result<Image> decode_rgb8(const std::string& name, std::span<const std::byte> file) {
  try {
    // OpenCV takes no pointer to const; it only reads.
    const cv::Mat input(1, static_cast<int>(file.size()), CV_8UC1,
                        const_cast<std::byte*>(file.data()));
    const cv::Mat bgr = cv::imdecode(input, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (bgr.empty()) return image_damaged(name, "its decoder gave up");
    if (bgr.type() != CV_8UC3) return image_damaged(name, "its decoder gave no 8-bit colours");
    Image image{bgr.cols, bgr.rows, PixelFormat::rgb8, {}};
    image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y)
      swap_red_blue(reinterpret_cast<const std::byte*>(bgr.ptr(y)),
                    image.data.data() + image.stride() * static_cast<std::size_t>(y), image.width);
    return image;
  } catch (const std::exception& e) {
    return image_damaged(name, std::string("its decoder says: ") + e.what());
  }
}

Result<std::vector<std::byte>> encode_png(const Image& image) {
  if (image.format != PixelFormat::rgb8)
    return Status(StatusCode::invalid_argument, "only rgb8 pictures are written as PNG");
  if (image.width < 1 || image.height < 1 ||
      image.data.size() < picture_bytes(image.format, image.stride(), image.height))
    return Status(StatusCode::invalid_argument, "the picture's data do not fill its size");
  try {
    cv::Mat bgr(image.height, image.width, CV_8UC3);
    for (int y = 0; y < image.height; ++y)
      swap_red_blue(image.data.data() + image.stride() * static_cast<std::size_t>(y),
                    reinterpret_cast<std::byte*>(bgr.ptr(y)), image.width);
    std::vector<unsigned char> png;
    if (!cv::imencode(".png", bgr, png))
      return Status(StatusCode::internal, "OpenCV could not encode the PNG");
    std::vector<std::byte> out(png.size());
    std::memcpy(out.data(), png.data(), png.size());
    return out;
  } catch (const std::exception& e) {
    return Status(StatusCode::internal,
                  std::string("OpenCV could not encode the PNG: ") + e.what());
  }
}

}  // namespace lightwell
