#include "calibration/solve/import/camera_fields.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/text.hpp>

namespace lightwell {

namespace {

// Limit of RigParameters::validate().
constexpr double kMaxSide_px = 16384;

std::string text_of(double value) { return formatted("%.9g", value); }

}  // namespace

std::string listed(std::span<const double> values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "" : ", ") + text_of(v);
  return out;
}

std::string size_problem(double width, double height) {
  for (const double side : {width, height})
    if (!(side >= 1 && side <= kMaxSide_px) || side != std::floor(side))
      return "a picture of " + text_of(width) + " x " + text_of(height) + " pixels; whole numbers from 1 to 16384";
  return {};
}

std::string numbers_problem(std::span<const double> values) {
  for (const double v : values)
    if (!std::isfinite(v)) return "has a value that is not finite (" + listed(values) + "); calibrate again";
  return {};
}

std::string pinhole_problem(const PinholeFields& p) {
  if (std::string s = numbers_problem(std::array{p.fx, p.fy, p.cx, p.cy}); !s.empty()) return s;
  if (!(p.fx > 0) || !(p.fy > 0))
    return "focal lengths must be positive, they are " + text_of(p.fx) + " and " + text_of(p.fy) +
           "; zero means a camera that was never calibrated";
  return {};
}

std::string camera_matrix_problem(std::span<const double> k) {
  if (k.size() != 9) return "needs 3 x 3 numbers, it has " + std::to_string(k.size());
  if (std::string s = numbers_problem(k); !s.empty()) return s;
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    return "must be fx 0 cx, 0 fy cy, 0 0 1, row by row; it is " + listed(k);
  if (k[1] != 0)
    return "has a skew of " + text_of(k[1]) +
           ", which is not supported; calibrate again with it fixed at zero (OpenCV: CALIB_FIX_SKEW)";
  return pinhole_problem(pinhole_of(k));
}

PinholeFields pinhole_of(std::span<const double> k) { return {k[0], k[4], k[2], k[5]}; }

KannalaBrandtParameters kannala_brandt_of(const PinholeFields& p, std::span<const double> k) {
  return {p.fx, p.fy, p.cx, p.cy, k[0], k[1], k[2], k[3]};
}

std::optional<ModelParameters> unified_lens(const PinholeFields& p, double xi, std::span<const double> d) {
  std::array<double, 4> first{};
  std::copy_n(d.begin(), std::min(d.size(), first.size()), first.begin());
  const auto rest = d.subspan(std::min(d.size(), first.size()));
  if (std::any_of(rest.begin(), rest.end(), [](double v) { return v != 0; })) return std::nullopt;
  return MeiParameters{p.fx, p.fy, p.cx, p.cy, xi, first[0], first[1], first[2], first[3]};
}

std::string no_exact_model(const std::string& model, const std::string& why) {
  return model + " is not supported, and no supported model is exactly equal: " + why +
         "; calibrate again with Kalibr's pinhole-equi, ds-none or omni-radtan, or with OpenCV's fisheye or omnidir";
}

}  // namespace lightwell
