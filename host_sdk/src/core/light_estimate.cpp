#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <lightwell/light_estimate.hpp>

namespace lightwell {
namespace {

/// ARKit's neutral intensity.
constexpr double kNeutralLumens = 1000;

using Column = std::array<double, 3>;

double luminance(const Column& c) { return luminance_of(c[0], c[1], c[2]); }

/// Mean radiance over the sphere: that of the harmonics, and the integral of each cap's radiance, over 4 pi. Of a cap
/// of radius rho with vector irradiance E that integral is 2 E / (1 + cos rho).
Column mean_radiance_of(const Descriptor& d) {
  constexpr double kSphere = 4 * std::numbers::pi;
  const double y00 = 1 / std::sqrt(kSphere);
  const auto channels = [](const auto& c) {
    return Column{static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
  };
  Column sum = channels(d.radiance.c[0]);
  for (double& channel : sum) channel *= y00;
  for (const Light& light : d.lights) {
    const double weight = 2 / (1 + std::cos(static_cast<double>(light.angular_radius_rad))) / kSphere;
    const Column irradiance = channels(light.irradiance);
    for (std::size_t i = 0; i < 3; ++i) sum[i] += weight * irradiance[i];
  }
  return sum;
}

/// The colour with its largest channel 1; zero if no channel is above zero. Negative channels are 0.
std::array<float, 3> pure_color(const Column& c) {
  const double largest = std::max({c[0], c[1], c[2]});
  std::array<float, 3> out{};
  for (std::size_t i = 0; i < 3 && largest > 0; ++i) out[i] = static_cast<float>(std::max(c[i], 0.0) / largest);
  return out;
}

bool is_positive(float v) { return v > 0 && std::isfinite(v); }

}  // namespace

Status LightEstimateOptions::validate() const {
  if (static_cast<std::uint32_t>(requested) > static_cast<std::uint32_t>(LightRequest::all))
    return invalid_argument("requested: has a bit that is not one of LightRequest");
  if (!is_positive(gain)) return invalid_argument("gain: must be above 0 and finite; to use no light, request none");
  if (!is_positive(neutral_illuminance))
    return invalid_argument("neutral_illuminance: must be above 0 and finite, lux");
  return {};
}

Converted<LightEstimate> estimate_light(const Lighting& lighting, const LightEstimateOptions& options) {
  Converted<LightEstimate> out{{}, lighting.validity(), std::nullopt};
  if (!options.validate().ok()) return {{}, Validity::invalid_query, std::nullopt};
  if (!out.has_estimate()) return out;
  const auto requested = [&](LightRequest part) { return has(options.requested, part); };
  const ConversionOptions scaled{.color = ColorMatrix::scale(options.gain), .residual = Residual::left_out};
  const Converted<ThreeLighting> apart = to_three(lighting, ThreeLights::physical, MainLight::apart, scaled);
  // A gain that no float holds.
  if (!apart.has_estimate()) return {{}, Validity::invalid_query, std::nullopt};
  LightEstimate& e = out.value;
  const auto give = [&](LightRequest part) { e.available = e.available | part; };
  const Column mean = mean_radiance_of(lighting.descriptor());
  const double gain = static_cast<double>(options.gain);
  const double lumens_per_lux = kNeutralLumens / static_cast<double>(options.neutral_illuminance);
  if (requested(LightRequest::ambient_intensity)) {
    const double illuminance = std::max(0.0, gain * std::numbers::pi * luminance(mean));
    e.mean_illuminance = static_cast<float>(illuminance);
    e.ambient_lumens = static_cast<float>(lumens_per_lux * illuminance);
    give(LightRequest::ambient_intensity);
  }
  if (requested(LightRequest::ambient_color) && luminance(mean) > 0) {
    e.ambient_color = pure_color(mean);
    const auto of_mean =
        color_temperature(static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2]));
    if (of_mean) {
      e.color_temperature = static_cast<float>(of_mean->kelvin);
      e.duv = static_cast<float>(of_mean->duv);
    }
    give(LightRequest::ambient_color);
  }
  const bool main_apart = requested(LightRequest::main_light_direction | LightRequest::main_light_intensity);
  if (requested(LightRequest::ambient_spherical_harmonics)) {
    e.ambient_spherical_harmonics =
        main_apart ? apart.value.sh
                   : to_three(lighting, ThreeLights::physical, MainLight::in_harmonics, scaled).value.sh;
    give(LightRequest::ambient_spherical_harmonics);
  }
  if (!(apart.value.intensity > 0)) return out;
  if (requested(LightRequest::main_light_direction)) {
    e.main_light_direction = apart.value.position;
    give(LightRequest::main_light_direction);
  }
  if (requested(LightRequest::main_light_intensity)) {
    const auto& c = apart.value.color;
    e.main_light_color = c;
    const double lux = static_cast<double>(apart.value.intensity) *
                       luminance({static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])});
    e.main_light_lumens = static_cast<float>(lumens_per_lux * lux);
    give(LightRequest::main_light_intensity);
  }
  return out;
}

Status FadeTimes::validate() const {
  if (hold.ns < 0) return invalid_argument("hold: must not be negative");
  if (fade.ns < 0) return invalid_argument("fade: must not be negative");
  return {};
}

Result<float> fade_weight(Duration age, const FadeTimes& times) {
  if (Status s = times.validate(); !s.ok()) return s;
  if (age <= times.hold) return 1.0F;
  const double t = static_cast<double>(age.ns - times.hold.ns) / static_cast<double>(times.fade.ns);
  // Also without a fade, where t is infinite.
  if (t >= 1) return 0.0F;
  return static_cast<float>(1 - t * t * (3 - 2 * t));
}

Result<float> fade_weight(const Lighting& lighting, const FadeTimes& times) {
  if (Status s = times.validate(); !s.ok()) return s;
  const bool has_light = lighting.validity() == Validity::valid || lighting.validity() == Validity::stale;
  return has_light ? fade_weight(lighting.age(), times) : Result<float>(0.0F);
}

}  // namespace lightwell
