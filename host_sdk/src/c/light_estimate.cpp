// C ABI of estimate_light(), color_temperature() and fade_weight().
#include <algorithm>

#include <lightwell/light_estimate.h>
#include <lightwell/light_estimate.hpp>

#include "c/call.hpp"

namespace lightwell::c {
namespace {

static_assert(LW_REQUEST_ALL == static_cast<int>(LightRequest::all) &&
              LW_REQUEST_AMBIENT_COLOR == static_cast<int>(LightRequest::ambient_color) &&
              LW_REQUEST_AMBIENT_SPHERICAL_HARMONICS == static_cast<int>(LightRequest::ambient_spherical_harmonics) &&
              LW_REQUEST_MAIN_LIGHT_DIRECTION == static_cast<int>(LightRequest::main_light_direction));

template <std::size_t n>
void copy_values(const std::array<float, n>& from, float (&to)[n]) {
  std::copy(from.begin(), from.end(), to);
}

lw_light_estimate_options as_c(const LightEstimateOptions& options) {
  return {0, static_cast<std::uint32_t>(options.requested), options.gain, options.neutral_illuminance};
}

lw_light_estimate as_c(const Converted<LightEstimate>& estimate) {
  const LightEstimate& e = estimate.value;
  lw_light_estimate out{};
  out.validity = static_cast<lw_validity>(estimate.validity);
  out.available = static_cast<std::uint32_t>(e.available);
  out.ambient_lumens = e.ambient_lumens;
  out.mean_illuminance = e.mean_illuminance;
  out.color_temperature = e.color_temperature;
  out.duv = e.duv;
  copy_values(e.ambient_color, out.ambient_color);
  copy_values(e.ambient_spherical_harmonics, out.ambient_spherical_harmonics);
  copy_values(e.main_light_direction, out.main_light_direction);
  copy_values(e.main_light_color, out.main_light_color);
  out.main_light_lumens = e.main_light_lumens;
  return out;
}

Status give(const Result<float>& weight, float* out) {
  if (out == nullptr) return null_argument("weight");
  if (weight.ok()) *out = *weight;
  return weight.status();
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_light_estimate_defaults(lw_light_estimate_options* options) {
  return call([&] { return write_sized(as_c(LightEstimateOptions()), "lw_light_estimate_options", options); });
}

lw_status lw_lighting_estimate(const lw_lighting* lighting, const lw_light_estimate_options* options,
                               lw_light_estimate* out) {
  const lw_status status = with_handle(lighting, [&](const Lighting& light) -> Status {
    lw_light_estimate_options given = as_c(LightEstimateOptions());
    if (options != nullptr)
      if (Status s = read_sized(options, "lw_light_estimate_options", given); !s.ok()) return s;
    const LightEstimateOptions parsed{static_cast<LightRequest>(given.requested), given.gain,
                                      given.neutral_illuminance};
    if (Status s = parsed.validate(); !s.ok()) return s.in("lw_light_estimate_options");
    return write_sized(as_c(estimate_light(light, parsed)), "lw_light_estimate", out);
  });
  return write_failure(status, "lw_light_estimate", out);
}

lw_status lw_color_temperature(const float* rgb, double* kelvin, double* duv) {
  return call([&]() -> Status {
    if (rgb == nullptr) return null_argument("rgb");
    const ColorTemperature found = color_temperature(rgb[0], rgb[1], rgb[2]).value_or(ColorTemperature{});
    if (kelvin != nullptr) *kelvin = found.kelvin;
    if (duv != nullptr) *duv = found.duv;
    return {};
  });
}

lw_status lw_fade_weight(int64_t age_ns, int64_t hold_ns, int64_t fade_ns, float* weight) {
  return call([&] { return give(fade_weight(Duration{age_ns}, {Duration{hold_ns}, Duration{fade_ns}}), weight); });
}

lw_status lw_lighting_fade_weight(const lw_lighting* lighting, int64_t hold_ns, int64_t fade_ns, float* weight) {
  return with_handle(lighting, [&](const Lighting& light) {
    return give(fade_weight(light, {Duration{hold_ns}, Duration{fade_ns}}), weight);
  });
}

}  // extern "C"
