#include "report/page.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include <lightwell/pixel.hpp>

#include "imaging/image_file.hpp"

namespace lightwell::hil {
namespace {

const cv::Scalar kPaper(245, 245, 245), kInk(40, 40, 40), kMark(60, 60, 255);

}  // namespace

LinearPicture cut_out(const LinearPicture& picture, int x, int y, int width, int height) {
  LinearPicture out(width, height);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      out.pixels[out.at(i, j)] = picture.pixels[picture.at(x + i, y + j)];
      out.alpha[out.at(i, j)] = picture.alpha[picture.at(x + i, y + j)];
    }
  return out;
}

double exposure_for(const LinearPicture& picture) {
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    sum += picture.alpha[i] * picture.pixels[i].luminance();
    weight += picture.alpha[i];
  }
  return sum > 0 ? 0.25 * weight / sum : 1;
}

Page::Page(int width, int height) : pixels_(std::make_unique<cv::Mat>(height, width, CV_8UC3, kPaper)) {}
Page::~Page() = default;
Page::Page(Page&&) noexcept = default;
Page& Page::operator=(Page&&) noexcept = default;

void Page::write(const std::string& text, int x, int y, double scale) {
  cv::putText(*pixels_, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, scale, kInk, 1, cv::LINE_AA);
}

void Page::paste(const LinearPicture& picture, int x, int y, double exposure, int shown_width) {
  const int width = shown_width > 0 ? shown_width : picture.width;
  const int height = static_cast<int>(std::lround(static_cast<double>(picture.height) * width / picture.width));
  cv::Mat place = (*pixels_)(cv::Rect(x, y, width, height)), shown;
  cv::resize(place, shown, {picture.width, picture.height}, 0, 0, cv::INTER_NEAREST);
  const auto code = [&](float v) {
    return 255 * linear_to_srgb(std::clamp(static_cast<double>(v) * exposure, 0.0, 1.0));
  };
  for (int j = 0; j < picture.height; ++j)
    for (int i = 0; i < picture.width; ++i) {
      const Radiance& l = picture.pixels[picture.at(i, j)];
      const auto alpha = static_cast<double>(picture.alpha[picture.at(i, j)]);
      cv::Vec3b& under = shown.at<cv::Vec3b>(j, i);
      const double over[3] = {code(l.b), code(l.g), code(l.r)};
      for (int k = 0; k < 3; ++k)
        under[k] = static_cast<unsigned char>(std::lround(over[k] * alpha + under[k] * (1 - alpha)));
    }
  cv::resize(shown, place, place.size(), 0, 0, cv::INTER_AREA);
}

void Page::ring(int x, int y, int radius, int number) {
  cv::circle(*pixels_, {x, y}, radius, kMark, 1, cv::LINE_AA);
  if (number > 0)
    cv::putText(*pixels_, std::to_string(number), {x + 7, y - 7}, cv::FONT_HERSHEY_SIMPLEX, 0.4, kMark, 1, cv::LINE_AA);
}

Status Page::save(const std::string& path) const {
  cv::Mat rgb;
  cv::cvtColor(*pixels_, rgb, cv::COLOR_BGR2RGB);
  Image image{rgb.cols, rgb.rows, PixelFormat::rgb8, {}};
  const auto* const bytes = reinterpret_cast<const std::byte*>(rgb.data);
  image.data.assign(bytes, bytes + rgb.total() * rgb.elemSize());
  return write_png(path, image);
}

}  // namespace lightwell::hil
