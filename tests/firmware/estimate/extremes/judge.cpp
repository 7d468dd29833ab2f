#include "firmware/estimate/extremes/judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>
#include <lightwell/text.hpp>

#include "reference/irradiance.hpp"

namespace lightwell::extremes {
namespace {

template <class Quantity>
bool finite(const Rgb<Quantity>& c) {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

Irradiance at(const Descriptor& d, const reference::V3& n) {
  return irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
}

}  // namespace

EstimatorConfig choice(Setting setting, double epsilon) {
  EstimatorConfig config;
  config.setting = setting;
  config.panorama.epsilon = epsilon;
  return config;
}

std::vector<EstimatorConfig> every_choice() {
  std::vector<EstimatorConfig> out;
  for (const Setting setting : kSettings)
    for (const double epsilon : {0.01, 0.0}) out.push_back(choice(setting, epsilon));
  return out;
}

std::string name_of(const EstimatorConfig& config) {
  return std::string(to_string(config.setting)) + (config.panorama.epsilon > 0 ? "" : ", epsilon 0");
}

std::unique_ptr<Estimator> estimator_of(const RigParameters& rig, const EstimatorConfig& config) {
  PanoramaOptions options;
  options.config = config;
  Result<std::unique_ptr<Estimator>> made = make_panorama_estimator(rig, options);
  if (made.ok()) return std::move(*made);
  std::fprintf(stderr, "extremes: %s\n", made.status().message().c_str());
  std::exit(1);
}

bool sound(const Descriptor& d) {
  bool good = std::isfinite(d.coverage) && d.coverage >= 0 && d.coverage <= 1 && std::isfinite(d.saturated) &&
              d.saturated >= 0 && d.saturated <= 1;
  for (const Rgb<RadianceTag>& c : d.radiance.c) good &= finite(c);
  for (const Light& l : d.lights)
    good &= std::abs(length(l.direction) - 1) < 1e-3F && finite(l.irradiance) && std::isfinite(l.angular_radius_rad) &&
            std::ranges::all_of(l.direction_covariance, [](float v) { return std::isfinite(v); }) && l.track != 0;
  for (const float part :
       {d.bound.total, d.bound.truncation, d.bound.sampling, d.bound.noise, d.bound.quantization, d.bound.smoothing})
    good &= !std::isnan(part) && part >= 0;
  if (!good) return false;
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  return bytes.ok() && decode_descriptor(*bytes).ok();
}

double error_of(const Descriptor& d, const std::vector<reference::V3>& normals,
                const std::vector<reference::Rgb>& truth) {
  std::vector<reference::Rgb> got;
  for (const reference::V3& n : normals) {
    const Irradiance e = at(d, n);
    got.push_back({e.r, e.g, e.b});
  }
  const reference::IrradianceError e = reference::irradiance_error(truth, got);
  return std::max(e.rms, e.luminance_weighted);
}

double largest_difference(const Descriptor& a, const Descriptor& b, const std::vector<reference::V3>& normals) {
  double largest = 0, square = 0;
  for (const reference::V3& n : normals) {
    const Irradiance x = at(a, n), y = at(b, n);
    for (int c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(static_cast<double>(x[c]) - y[c]));
      square += static_cast<double>(x[c]) * x[c];
    }
  }
  const double rms = std::sqrt(square / static_cast<double>(3 * normals.size()));
  return rms > 0 ? largest / rms : largest;
}

bool Tally::count(const Descriptor& d, const std::string& where) {
  ++answers;
  if (d.flags.any()) ++flagged;
  if (!sound(d)) {
    if (unsound++ == 0) unsound_case = where;
    return false;
  }
  if (std::isinf(d.bound.total)) {
    ++infinite;
    if (!d.flags.any() && silent++ == 0) silent_case = where + ": no bound and no flag";
  }
  return true;
}

void Tally::count(const Descriptor& d, const std::vector<reference::V3>& normals,
                  const std::vector<reference::Rgb>& truth, const std::string& where) {
  if (!count(d, where) || std::isinf(d.bound.total)) return;
  // Evaluates the decoded descriptor, which applications receive.
  Encoder encoder;
  const double error = error_of(*decode_descriptor(*encoder.encode(d)), normals, truth);
  worst_error = std::max(worst_error, error);
  if (!(error <= d.bound.total)) ++missed;
  const double ratio = error / static_cast<double>(d.bound.total);
  if (!(ratio <= worst_over_bound)) {
    worst_over_bound = ratio;
    worst_case = where + formatted(": error %.4g, bound %.4g", error, static_cast<double>(d.bound.total));
  }
}

void Tally::expect_flag(const Descriptor& d, Flag flag, const std::string& where) {
  if (!d.flags.has(flag) && silent++ == 0) silent_case = where + ": not flagged " + std::string(to_string(flag));
}

void Tally::expect_no_bound(const Descriptor& d, const std::string& where) {
  if (!std::isinf(d.bound.total) && silent++ == 0)
    silent_case = where + ": a finite bound of " + std::to_string(d.bound.total);
}

void Tally::add(const Tally& o) {
  answers += o.answers;
  refused += o.refused;
  flagged += o.flagged;
  infinite += o.infinite;
  unsound += o.unsound;
  missed += o.missed;
  silent += o.silent;
  worst_error = std::max(worst_error, o.worst_error);
  if (o.worst_over_bound > worst_over_bound) worst_over_bound = o.worst_over_bound, worst_case = o.worst_case;
  if (unsound_case.empty()) unsound_case = o.unsound_case;
  if (silent_case.empty()) silent_case = o.silent_case;
}

}  // namespace lightwell::extremes
