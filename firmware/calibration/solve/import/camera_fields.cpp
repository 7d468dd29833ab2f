#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/solve/import/readers.hpp"

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

void check_size(const Fields& fields, const std::string& key, double width, double height) {
  for (const double side : {width, height})
    if (!(side >= 1 && side <= kMaxSide_px) || side != std::floor(side))
      fields.refuse(
          key, "a picture of " + text_of(width) + " x " + text_of(height) + " pixels; whole numbers from 1 to 16384");
}

void check_numbers(const Fields& fields, const std::string& key, std::span<const double> values) {
  for (const double v : values)
    if (!std::isfinite(v))
      fields.refuse(key, "has a value that is not finite (" + listed(values) + "); calibrate again");
}

void check_pinhole(const Fields& fields, const std::string& key, const PinholeFields& p) {
  check_numbers(fields, key, std::array{p.fx, p.fy, p.cx, p.cy});
  if (!(p.fx > 0) || !(p.fy > 0))
    fields.refuse(key, "focal lengths must be positive, they are " + text_of(p.fx) + " and " + text_of(p.fy) +
                           "; zero means a camera that was never calibrated");
}

PinholeFields pinhole_of(const Fields& fields, const std::string& key, std::span<const double> k) {
  if (k.size() != 9) fields.refuse(key, "needs 3 x 3 numbers, it has " + std::to_string(k.size()));
  check_numbers(fields, key, k);
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    fields.refuse(key, "must be fx 0 cx, 0 fy cy, 0 0 1, row by row; it is " + listed(k));
  if (k[1] != 0)
    fields.refuse(key, "has a skew of " + text_of(k[1]) +
                           ", which is not supported; calibrate again with it fixed at zero (OpenCV: CALIB_FIX_SKEW)");
  const PinholeFields p{k[0], k[4], k[2], k[5]};
  check_pinhole(fields, key, p);
  return p;
}

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

FieldOfView field_of_view(const LensParameters& lens) {
  LensParameters whole = lens;
  whole.max_angle_rad = std::numbers::pi;
  const CameraModel model(whole);
  FieldOfView out;
  out.model_rad = model.max_angle_rad();
  const auto centre = model.project({0, 0, 1});
  if (!centre) return out;
  // The edge of the picture is the outer edge of its outermost pixels.
  const double radius =
      std::min({centre->x + 0.5, lens.width - 0.5 - centre->x, centre->y + 0.5, lens.height - 0.5 - centre->y});
  if (!(radius > 0)) return out;
  double angle = out.model_rad;
  // Tangential distortion varies with the azimuth and its double: steps of half a degree suffice.
  constexpr int kAzimuths = 720;
  for (int i = 0; i < kAzimuths; ++i) {
    const double phi = 2 * std::numbers::pi * i / kAzimuths;
    const auto d = model.unproject({centre->x + radius * std::cos(phi), centre->y + radius * std::sin(phi)});
    // A point of the circle without a direction is beyond the model's domain, which model_rad already limits.
    if (d) angle = std::min(angle, std::atan2(std::hypot(d->x, d->y), d->z));
  }
  out.circle_rad = angle;
  return out;
}

}  // namespace lightwell
