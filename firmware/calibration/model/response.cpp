#include "calibration/model/response.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/pixel.hpp>

namespace lightwell {

namespace {

double interpolated(const std::vector<double>& table, double value) {
  if (table.size() < 2) return value;
  const double at = value * static_cast<double>(table.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), table.size() - 2);
  const double share = at - static_cast<double>(i);
  return table[i] * (1 - share) + table[i + 1] * share;
}

/// Position (fractional index) at which an increasing table reaches `linear`; the beginning of a constant section.
double position_in(const std::vector<double>& table, double linear) {
  if (table.size() < 2) return linear;
  const auto above = std::lower_bound(table.begin(), table.end(), linear);
  if (above == table.begin()) return 0;
  if (above == table.end()) return 1;
  const double low = *(above - 1), high = *above;
  const double i = static_cast<double>(above - table.begin() - 1) + (linear - low) / (high - low);
  return i / static_cast<double>(table.size() - 1);
}

}  // namespace

double linearized(const ResponseCurve& response, double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  if (response.kind == ResponseCurve::Kind::srgb) return srgb_to_linear(v);
  if (response.kind == ResponseCurve::Kind::table) return interpolated(response.inverse, v);
  return response.kind == ResponseCurve::Kind::gamma ? std::pow(v, response.gamma) : v;
}

double encoded(const ResponseCurve& response, double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  if (response.kind == ResponseCurve::Kind::srgb) return linear_to_srgb(x);
  if (response.kind == ResponseCurve::Kind::table) return position_in(response.inverse, x);
  return response.kind == ResponseCurve::Kind::gamma ? std::pow(x, 1 / response.gamma) : x;
}

double linear_value(const PhotometricCalibration& photometry, double value) {
  return (linearized(photometry.response, value) - photometry.black_level) / (1 - photometry.black_level);
}

std::vector<float> linear_table(const PhotometricCalibration& photometry, int levels) {
  std::vector<float> table(static_cast<std::size_t>(std::max(levels, 0)));
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double value = levels > 1 ? static_cast<double>(i) / (levels - 1) : 0.0;
    table[i] = static_cast<float>(linear_value(photometry, value));
  }
  return table;
}

unsigned saturated_from(const PhotometricCalibration& photometry, int levels) {
  return static_cast<unsigned>(std::ceil(photometry.saturation * (levels - 1)));
}

double vignetting(const PhotometricCalibration& photometry, double angle_rad) {
  const double t = angle_rad * angle_rad;
  const auto& v = photometry.vignetting;
  return std::max(1 + t * (v[0] + t * (v[1] + t * v[2])), 0.05);
}

}  // namespace lightwell
