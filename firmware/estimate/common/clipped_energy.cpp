#include "estimate/common/clipped_energy.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/cap.hpp>
#include <lightwell/query.hpp>

namespace lightwell {
namespace {

const Light* light_of(const Descriptor& d, std::uint32_t track) {
  for (const Light& light : d.lights)
    if (light.track == track) return &light;
  return nullptr;
}

/// Irradiance of a receiver with this normal per vector irradiance of the light.
double receiver_factor(const Light& light, Vec3f normal) {
  return cap_irradiance(dot(vec_cast<double>(light.direction), vec_cast<double>(normal)), light.angular_radius_rad);
}

bool is_unit(Vec3f v) {
  const double length = std::sqrt(dot(vec_cast<double>(v), vec_cast<double>(v)));
  return std::abs(length - 1) < 1e-3;
}

}  // namespace

RecoveryFault recover(const Descriptor& d, std::span<const ClippedLight> clipped, const DiffuseConstraint& constraint,
                      Recovery& out) {
  const double reading = constraint.irradiance;
  if (!(reading > 0) || !std::isfinite(reading) || !is_unit(constraint.normal)) return RecoveryFault::no_reading;
  double observed = irradiance_at(d, constraint.normal).luminance(), at_receiver = 0, at_normal = 0;
  for (const ClippedLight& c : clipped) {
    const Light* light = light_of(d, c.track);
    if (light == nullptr) return RecoveryFault::nothing_clipped;
    const double measured = c.measured.luminance(), factor_at_receiver = receiver_factor(*light, constraint.normal);
    observed -= (light->irradiance.luminance() - measured) * factor_at_receiver;
    at_receiver += measured * factor_at_receiver;
    at_normal += measured;
  }
  if (!(at_normal > 0) || !std::isfinite(at_normal) || !std::isfinite(observed)) return RecoveryFault::nothing_clipped;
  if (at_receiver < kMinReceiverFactor * at_normal) return RecoveryFault::faces_away;
  if (reading < (1 - kMeterRelativeError) * observed) return RecoveryFault::below_observed;
  const auto factor = static_cast<float>(1 + std::max(0.0, reading - observed) / at_receiver);
  const double relative_uncertainty = kMeterRelativeError * reading / at_receiver;
  out.count = 0;
  for (const ClippedLight& c : clipped.first(std::min(clipped.size(), out.lights.size())))
    out.lights[out.count++] = {c.track, c.measured * factor,
                               static_cast<float>(relative_uncertainty * c.measured.luminance())};
  return RecoveryFault::none;
}

Status status_of(RecoveryFault fault) {
  switch (fault) {
    case RecoveryFault::none:
      return {};
    case RecoveryFault::no_reading:
      return invalid_argument("the reading must be positive and finite, and its normal a unit vector");
    case RecoveryFault::nothing_clipped:
      return {StatusCode::failed_precondition,
              "no light is clipped, or pixels outside of lights are: the reading cannot be attributed to lights"};
    case RecoveryFault::faces_away:
      return {StatusCode::failed_precondition,
              "the receiver gets too little of the clipped light for its normal: turn it towards the light"};
    case RecoveryFault::below_observed:
      return invalid_argument("the reading is below the irradiance that the camera observed: check its unit");
  }
  return {StatusCode::internal, "unknown"};
}

RecoveryResult apply(Recovery& known, std::span<const ClippedLight> clipped, Descriptor& d) {
  RecoveryResult out;
  const auto is_clipped = [&](const RecoveredLight& r) {
    return std::any_of(clipped.begin(), clipped.end(), [&](const ClippedLight& c) { return c.track == r.track; });
  };
  const auto end = std::remove_if(known.lights.begin(), known.lights.begin() + static_cast<std::ptrdiff_t>(known.count),
                                  [&](const RecoveredLight& r) { return !is_clipped(r); });
  known.count = static_cast<std::size_t>(end - known.lights.begin());
  std::size_t found = 0;
  for (std::size_t k = 0; k < known.count; ++k) {
    const RecoveredLight& r = known.lights[k];
    for (Light& light : d.lights) {
      if (light.track != r.track) continue;
      ++found;
      light.irradiance = {std::max(light.irradiance.r, r.irradiance.r), std::max(light.irradiance.g, r.irradiance.g),
                          std::max(light.irradiance.b, r.irradiance.b)};
      out.uncertainty += r.uncertainty;
    }
  }
  out.all = found > 0 && found == clipped.size();
  return out;
}

}  // namespace lightwell
