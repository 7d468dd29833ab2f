#include "calibration/solve/photometry/patch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr double kMinMean = 0.02, kMaxRelativeDeviation = 0.2, kMaxSaturatedFraction = 1e-3;
constexpr const char* kChannel[] = {"red", "green", "blue"};

}  // namespace

Result<PatchMean> patch_mean(const Picture& picture, const PatchRect& patch, const PhotometricCalibration& photometry,
                             const std::string& name) {
  const auto invalid = [&](const std::string& what) {
    return Status(StatusCode::invalid_argument, name + ": " + what);
  };
  const int pitch = picture.pitch;
  // 64 bits, because the patch is user input and may overflow 32.
  const std::int64_t right = std::int64_t{patch.x} + patch.width, below = std::int64_t{patch.y} + patch.height;
  if (patch.x < 0 || patch.y < 0 || patch.width < 1 || patch.height < 1 ||
      right > std::int64_t{picture.width} * pitch || below > std::int64_t{picture.height} * pitch)
    return invalid("the patch " + std::to_string(patch.x) + "," + std::to_string(patch.y) + "," +
                   std::to_string(patch.width) + "," + std::to_string(patch.height) + " lies outside the picture of " +
                   std::to_string(picture.width * pitch) + "x" + std::to_string(picture.height * pitch) + " pixels");
  const int x0 = (patch.x + pitch - 1) / pitch, x1 = static_cast<int>(right) / pitch;
  const int y0 = (patch.y + pitch - 1) / pitch, y1 = static_cast<int>(below) / pitch;
  if (x1 <= x0 || y1 <= y0 || (x1 - x0) * (y1 - y0) < 16)
    return invalid("the patch has fewer than 16 sites; choose a larger one");

  PatchMean out;
  out.count = static_cast<double>(x1 - x0) * (y1 - y0);
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    double saturated = 0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const double v = static_cast<double>(picture.at(x, y, c));
        saturated += v >= photometry.saturation ? 1 : 0;
        values.push_back((linearized(photometry.response, v) - photometry.black_level) / (1 - photometry.black_level));
      }
    const std::string channel = kChannel[c];
    if (saturated > kMaxSaturatedFraction * out.count)
      return invalid("the patch is saturated in " + channel + "; take it with a shorter exposure");
    double mean = median_of(values), deviation = 0, count = 0;
    std::vector<double> centred = values;
    for (double& v : centred) v -= mean;
    deviation = std::max(scale_about_zero(centred), 2 * rounding_deviation(picture.levels));
    for (int pass = 0; pass < 4; ++pass) {
      double sum = 0, squares = 0;
      count = 0;
      for (const double v : values) {
        if (std::abs(v - mean) > 5 * deviation) continue;
        sum += v - mean;
        squares += (v - mean) * (v - mean);
        ++count;
      }
      if (count < 2) break;
      deviation = std::max(std::sqrt(std::max(0.0, (squares - sum * sum / count) / (count - 1))),
                           rounding_deviation(picture.levels));
      mean += sum / count;
    }
    if (!(mean > kMinMean))
      return invalid("the patch is too dark in " + channel + " (" + std::to_string(mean) +
                     " of full scale); take it with a longer exposure");
    if (deviation > kMaxRelativeDeviation * mean || count < 0.9 * out.count)
      return invalid("the patch is not even in " + channel +
                     "; choose one that lies inside the card, without a shadow");
    out.mean[static_cast<std::size_t>(c)] = mean;
    out.deviation[static_cast<std::size_t>(c)] = deviation / std::sqrt(count);
  }
  return out;
}

}  // namespace lightwell::photometry
