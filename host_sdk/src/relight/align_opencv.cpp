// Alignment by OpenCV's optical flow.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include <lightwell/relight_align.hpp>

#include "relight/subject.hpp"

namespace lightwell {
namespace {

/// DIS starts from squares of 8 pixels on a coarser level.
constexpr int kMinSide = 16;
/// Share of pixels that may be brighter than white.
constexpr double kWhiteQuantile = 0.99;

float grey(const Radiance& r) {
  const float sum = (r.r + r.g + r.b) / 3;
  return sum > 0 && std::isfinite(sum) ? sum : 0.0F;
}

/// 8 bits, square roots: noise of photons is the same everywhere.
cv::Mat codes_of(std::span<const Radiance> picture, int columns, int rows, float white) {
  cv::Mat out(rows, columns, CV_8U);
  for (std::size_t p = 0; p < picture.size(); ++p)
    out.data[p] = static_cast<std::uint8_t>(std::lround(255 * std::sqrt(std::min(grey(picture[p]) / white, 1.0F))));
  return out;
}

float white_of(std::span<const Radiance> picture) {
  std::vector<float> values;
  values.reserve(picture.size());
  for (const Radiance& r : picture) values.push_back(grey(r));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(kWhiteQuantile * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return std::max(*at, std::numeric_limits<float>::min());
}

AlignmentSummary summary_of(const cv::Mat2f& there, const cv::Mat2f& back) {
  AlignmentSummary out;
  std::vector<double> lengths;
  for (int row = 0; row < there.rows; ++row)
    for (int column = 0; column < there.cols; ++column) {
      const cv::Vec2f d = there(row, column);
      lengths.push_back(std::hypot(static_cast<double>(d[0]), static_cast<double>(d[1])));
      const int to_column =
          std::clamp(static_cast<int>(std::lround(static_cast<float>(column) + d[0])), 0, there.cols - 1);
      const int to_row = std::clamp(static_cast<int>(std::lround(static_cast<float>(row) + d[1])), 0, there.rows - 1);
      const cv::Vec2f e = back(to_row, to_column);
      if (std::hypot(d[0] + e[0], d[1] + e[1]) > 1) ++out.uncertain;
    }
  out.largest_px = *std::ranges::max_element(lengths);
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::ranges::nth_element(lengths, middle);
  out.median_px = *middle;
  return out;
}

/// picture(x + share * flow(x)).
std::vector<Radiance> moved(std::span<const Radiance> picture, const cv::Mat2f& flow, float share) {
  cv::Mat2f from(flow.size());
  for (int row = 0; row < flow.rows; ++row)
    for (int column = 0; column < flow.cols; ++column)
      from(row, column) = {static_cast<float>(column) + share * flow(row, column)[0],
                           static_cast<float>(row) + share * flow(row, column)[1]};
  std::vector<Radiance> out(picture.size());
  // OpenCV has no view of memory that it may only read.
  cv::Mat source(flow.size(), CV_32FC3, const_cast<Radiance*>(picture.data()));
  cv::Mat target(flow.size(), CV_32FC3, out.data());
  cv::remap(source, target, from, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

}  // namespace

Result<AlignmentSummary> align_photographs(int columns, int rows, const TimedPhotograph& first_tracking,
                                           const TimedPhotograph& second_tracking,
                                           std::span<const TimedPhotograph> photographs,
                                           std::vector<std::vector<Radiance>>& out) {
  static_assert(sizeof(Radiance) == 3 * sizeof(float));
  if (columns < kMinSide || rows < kMinSide || columns > RelightCamera::kMaxSide || rows > RelightCamera::kMaxSide)
    return invalid_argument("alignment: columns and rows must be 16 to 4096");
  const auto check = [&](const std::string& name, const TimedPhotograph& p) {
    if (!(p.time_s >= first_tracking.time_s && p.time_s <= second_tracking.time_s))
      return invalid_argument(name + " was not taken between the tracking frames");
    return relight::check_size(name, p.picture.size(),
                               static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  };
  if (!(first_tracking.time_s < second_tracking.time_s) || !std::isfinite(first_tracking.time_s) ||
      !std::isfinite(second_tracking.time_s))
    return invalid_argument("the second tracking frame is not after the first one");
  if (Status status = check("the first tracking frame", first_tracking); !status.ok()) return status;
  if (Status status = check("the second tracking frame", second_tracking); !status.ok()) return status;
  for (std::size_t i = 0; i < photographs.size(); ++i)
    if (Status status = check("photograph " + std::to_string(i), photographs[i]); !status.ok()) return status;
  try {
    const float white = white_of(first_tracking.picture);
    const cv::Mat first = codes_of(first_tracking.picture, columns, rows, white);
    const cv::Mat second = codes_of(second_tracking.picture, columns, rows, white);
    const auto flow = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
    cv::Mat2f there, back;
    flow->calc(first, second, there);
    flow->calc(second, first, back);
    std::vector<std::vector<Radiance>> pictures;
    const double cycle = second_tracking.time_s - first_tracking.time_s;
    for (const TimedPhotograph& p : photographs)
      pictures.push_back(moved(p.picture, there, static_cast<float>((p.time_s - first_tracking.time_s) / cycle)));
    out = std::move(pictures);
    return summary_of(there, back);
  } catch (const cv::Exception& error) {
    return Status(StatusCode::internal, std::string("alignment: OpenCV: ") + error.what());
  }
}

}  // namespace lightwell
