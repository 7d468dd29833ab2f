#include "c/result_conversion.hpp"

namespace lightwell::c {
namespace {

static_assert(LW_VALID == static_cast<int>(Validity::valid) && LW_STALE == static_cast<int>(Validity::stale) &&
              LW_NONE == static_cast<int>(Validity::none) &&
              LW_BEFORE_HISTORY == static_cast<int>(Validity::before_history) &&
              LW_INVALID_QUERY == static_cast<int>(Validity::invalid_query));
static_assert(LW_MEASURED == static_cast<int>(Derivation::measured) &&
              LW_INTERPOLATED == static_cast<int>(Derivation::interpolated) &&
              LW_EXTRAPOLATED == static_cast<int>(Derivation::extrapolated) &&
              LW_HELD == static_cast<int>(Derivation::held));
static_assert(LW_RELATIVE == static_cast<int>(Units::relative) && LW_ABSOLUTE == static_cast<int>(Units::absolute));
static_assert(LW_MAX_BAND == kMaxBand && LW_MAX_COEFFICIENTS == sh_count(kMaxBand) && LW_MAX_LIGHTS == kMaxLights &&
              LW_MAX_ENVIRONMENT_LEVELS == kMaxEnvironmentLevels);

constexpr std::uint32_t bit(Flag flag) { return 1U << static_cast<unsigned>(flag); }
static_assert(LW_FLAG_UNSEEN == bit(Flag::unseen) && LW_FLAG_CLIPPED == bit(Flag::clipped) &&
              LW_FLAG_CLEANED == bit(Flag::cleaned) && LW_FLAG_DARK == bit(Flag::dark) &&
              LW_FLAG_MOVED == bit(Flag::moved) && LW_FLAG_FILLED == bit(Flag::filled) &&
              LW_FLAG_RECOVERED == bit(Flag::recovered) && LW_FLAG_UNSURE == bit(Flag::unsure) &&
              LW_FLAG_NEWER == bit(Flag::newer));

}  // namespace

const char* reason_of(Validity validity) {
  switch (validity) {
    case Validity::valid:
      return "";
    case Validity::stale:
      return "the nearest descriptor is, or may be, further away than max_age_ns";
    case Validity::none:
      return "no descriptor has come yet";
    case Validity::before_history:
      return "the time is before the oldest stored descriptor; options.history stores more";
    case Validity::invalid_query:
      return "the direction, roughness or rotation is zero or not finite";
  }
  return "unknown";
}

std::uint32_t bits_of(Flags flags) {
  std::uint32_t bits = 0;
  for (const Flag flag : kFlags)
    if (flags.has(flag)) bits |= bit(flag);
  return bits;
}

lw_lighting_info as_c(const Lighting& lighting) {
  const Descriptor& d = lighting.descriptor();
  lw_lighting_info out{};
  out.size = sizeof out;
  out.validity = static_cast<lw_validity>(lighting.validity());
  out.age_ns = lighting.age().ns;
  out.reason = reason_of(lighting.validity());
  out.age_uncertainty_ns = lighting.age_uncertainty().ns;
  out.sequence = d.sequence;
  out.mid_exposure_ns = lighting.mid_exposure().ns;
  out.received_ns = lighting.received().ns;
  out.probe_mid_exposure_ns = d.time.mid_exposure.ns;
  out.delivered_after_ns = d.time.delivered_after.ns;
  out.encoded_after_ns = d.time.encoded_after.ns;
  out.encoded_bytes = lighting.encoded_bytes();
  out.units = static_cast<lw_units>(d.units);
  out.flags = bits_of(d.flags);
  out.bound_total = d.bound.total;
  out.bound_truncation = d.bound.truncation;
  out.bound_sampling = d.bound.sampling;
  out.bound_noise = d.bound.noise;
  out.bound_quantization = d.bound.quantization;
  out.bound_smoothing = d.bound.smoothing;
  out.coverage = d.coverage;
  out.saturated = d.saturated;
  out.band = d.radiance.band;
  out.light_count = static_cast<std::uint32_t>(d.lights.size());
  out.probe_id = d.probe_id;
  out.calibration_id = d.calibration_id;
  out.setting = static_cast<std::int32_t>(d.setting);
  out.flicker = static_cast<std::int32_t>(d.flicker);
  out.derivation = static_cast<lw_derivation>(lighting.derivation());
  return out;
}

lw_light as_c(const Light& light) {
  lw_light out{};
  out.size = sizeof out;
  out.track = light.track;
  out.direction[0] = light.direction.x;
  out.direction[1] = light.direction.y;
  out.direction[2] = light.direction.z;
  for (int k = 0; k < 3; ++k) out.irradiance[k] = light.irradiance[k];
  out.angular_radius = light.angular_radius_rad;
  for (std::size_t k = 0; k < 3; ++k) out.direction_covariance[k] = light.direction_covariance[k];
  return out;
}

}  // namespace lightwell::c
