#include "bench/alhakamy2019.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace lightwell::bench {

namespace {

/// Sets OpenCV's number of threads, which is global to the process, to one and restores it.
class OneThread {
 public:
  OneThread() : before_(cv::getNumThreads()) { cv::setNumThreads(1); }
  ~OneThread() { cv::setNumThreads(before_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int before_;
};

/// The median grey level.
int median_of(const cv::Mat& histogram, double pixels) {
  double below = 0;
  for (int level = 0; level < 256; ++level) {
    below += static_cast<double>(histogram.at<float>(level));
    if (below >= 0.5 * pixels) return level;
  }
  return 255;
}

/// Luminance, 0..1, of a colour with values 0..255.
double intensity_of(const Triple& rgb) { return (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) / 255; }

}  // namespace

AlhakamyResult alhakamy_detect(const EquirectFrame& frame, const AlhakamyOptions& options) {
  AlhakamyResult result;
  if (frame.width < 1 || frame.height < 1) return result;
  const OneThread one;
  // OpenCV has no const view of external pixels; nothing writes to them.
  const cv::Mat picture(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()), frame.stride);

  cv::Mat grey, histogram, mask;
  cv::cvtColor(picture, grey, cv::COLOR_RGB2GRAY);
  const int levels = 256, channel = 0;
  const std::array<float, 2> range{0, 256};
  const float* ranges = range.data();
  cv::calcHist(&grey, 1, &channel, cv::noArray(), histogram, 1, &levels, &ranges);
  result.median_grey = median_of(histogram, static_cast<double>(grey.total()));
  result.threshold_grey =
      options.threshold == AlhakamyOptions::Threshold::median ? result.median_grey : (result.median_grey + 256) / 2;

  cv::GaussianBlur(grey, grey, {options.blur_size, options.blur_size}, 0);
  // OpenCV keeps values above the threshold; one less also keeps the threshold itself, "to 255".
  cv::threshold(grey, mask, result.threshold_grey - 1, 255, cv::THRESH_BINARY);
  cv::erode(mask, mask, {}, {-1, -1}, options.erosions);
  cv::dilate(mask, mask, {}, {-1, -1}, options.dilations);

  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  result.contours = static_cast<int>(contours.size());
  std::vector<std::pair<double, std::size_t>> by_area;
  for (std::size_t k = 0; k < contours.size(); ++k) by_area.emplace_back(cv::contourArea(contours[k]), k);
  std::stable_sort(by_area.begin(), by_area.end(), [](const auto& a, const auto& b) { return a.first > b.first; });

  const cv::Scalar mean = cv::mean(picture);
  const double mean_intensity = intensity_of({mean[0], mean[1], mean[2]});
  for (const auto& [area, k] : by_area) {
    if (result.lights.size() >= static_cast<std::size_t>(std::max(0, options.main_lights))) break;
    const cv::Rect box = cv::boundingRect(contours[k]);
    cv::Mat inside = cv::Mat::zeros(box.size(), CV_8U);
    cv::drawContours(inside, contours, static_cast<int>(k), 255, cv::FILLED, cv::LINE_8, cv::noArray(), 0, -box.tl());
    const cv::Scalar colour = cv::mean(picture(box), inside);
    const cv::Moments moments = cv::moments(contours[k]);
    // A contour that is a line or a point has no area; the centre of its bounding box is used.
    const bool flat = !(moments.m00 > 0);
    const double x = flat ? box.x + 0.5 * (box.width - 1) : moments.m10 / moments.m00;
    const double y = flat ? box.y + 0.5 * (box.height - 1) : moments.m01 / moments.m00;
    AlhakamyLight light;
    light.area_px = area;
    light.direction = equirect_direction(x + 0.5, y + 0.5, frame.width, frame.height);
    light.colour = {colour[0], colour[1], colour[2]};
    light.intensity = intensity_of(light.colour);
    const double together = light.intensity + mean_intensity;
    light.shadow_strength = together > 0 ? light.intensity / together : 0;
    result.lights.push_back(light);
  }
  return result;
}

}  // namespace lightwell::bench
