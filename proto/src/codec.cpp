#include <lightwell/codec.hpp>

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <lightwell/lobes.hpp>
#include <numbers>
#include <vector>

#include "lightwell/v1/descriptor.pb.h"
#include "quantize.hpp"

namespace lightwell {
namespace {

constexpr float kDirectionScale = 8191;
constexpr double kRadiusUnit = 1e-5;

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, "descriptor: " + what}; }

template <class Quantity>
bool finite(const Rgb<Quantity>& v) {
  return std::isfinite(v.r) && std::isfinite(v.g) && std::isfinite(v.b);
}

template <class Quantity>
float largest(const Rgb<Quantity>& v) {
  return std::max({std::abs(v.r), std::abs(v.g), std::abs(v.b)});
}

float largest_coefficient(const RadianceSh& sh) {
  float m = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh.count()); ++i) m = std::max(m, largest(sh.c[i]));
  return m;
}

bool share(float v) { return v >= 0 && v <= 1; }

/// What the wire cannot hold, or what no estimator may say.
Status problem(const Descriptor& d) {
  if (d.radiance.band < 0 || d.radiance.band > kMaxBand) return invalid("radiance.band must be 0 to 6");
  for (std::size_t i = 0; i < static_cast<std::size_t>(d.radiance.count()); ++i)
    if (!finite(d.radiance.c[i])) return invalid("radiance has a coefficient that is not finite");
  if (d.lights.size() > kMaxLights) return invalid("more than 64 lights");
  for (const Light& light : d.lights) {
    const float n = length(light.direction);
    if (!(n > 0.99F && n < 1.01F)) return invalid("a light's direction is not a unit vector");
    if (!finite(light.irradiance)) return invalid("a light's irradiance is not finite");
    if (!(light.angular_radius_rad >= 0 && light.angular_radius_rad <= std::numbers::pi_v<float> / 2 + 1e-5F))
      return invalid("a light's angular radius is not within 0 and pi/2");
    for (const float v : light.direction_covariance)
      if (!std::isfinite(v)) return invalid("a light's direction covariance is not finite");
  }
  if (!share(d.coverage)) return invalid("coverage must be 0 to 1");
  if (!share(d.saturated)) return invalid("saturated must be 0 to 1");
  for (const float v : {d.bound.total, d.bound.truncation, d.bound.sampling, d.bound.noise, d.bound.quantization})
    if (!(v >= 0)) return invalid("a part of the bound is negative or NaN");
  return {};
}

void fill_radiance(const RadianceSh& sh, v1::SphericalHarmonics& m) {
  const int exponent = exponent_for(largest_coefficient(sh));
  int band = 0;
  for (int l = 1; l <= sh.band; ++l)
    for (int i = l * l; i < sh_count(l); ++i)
      for (int k = 0; k < 3; ++k)
        if (mantissa_of(sh.c[static_cast<std::size_t>(i)][k], exponent) != 0) band = l;
  m.set_band(static_cast<std::uint32_t>(band));
  m.set_exponent(exponent);
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(band)); ++i)
    for (int k = 0; k < 3; ++k) m.add_mantissa(mantissa_of(sh.c[i][k], exponent));
}

void fill_light(const Light& light, v1::Light& m) {
  for (const float v : {light.direction.x, light.direction.y, light.direction.z})
    m.add_direction(static_cast<std::int32_t>(std::nearbyint(v * kDirectionScale)));
  const int exponent = exponent_for(largest(light.irradiance));
  for (int k = 0; k < 3; ++k) m.add_irradiance_mantissa(mantissa_of(light.irradiance[k], exponent));
  m.set_irradiance_exponent(exponent);
  m.set_angular_radius_e5(static_cast<std::uint32_t>(std::lround(light.angular_radius_rad / kRadiusUnit)));
  for (const float v : light.direction_covariance) m.add_direction_covariance(v);
  m.set_track(light.track);
}

std::uint32_t microseconds(Duration d) {
  const std::int64_t us = d.ns / 1000;
  return us <= 0 ? 0 : us > 0xFFFFFFFF ? 0xFFFFFFFFU : static_cast<std::uint32_t>(us);
}

Status read_radiance(const v1::SphericalHarmonics& m, RadianceSh& sh) {
  if (m.band() > kMaxBand) return invalid("radiance.band is " + std::to_string(m.band()) + ", more than 6");
  sh.band = static_cast<int>(m.band());
  if (m.mantissa_size() != 3 * sh.count())
    return invalid("radiance.mantissa has " + std::to_string(m.mantissa_size()) + " numbers, band " +
                   std::to_string(sh.band) + " needs " + std::to_string(3 * sh.count()));
  // 2^100 times 8191 still is a float.
  if (m.exponent() < -150 || m.exponent() > 100) return invalid("radiance.exponent is out of range");
  for (int i = 0; i < m.mantissa_size(); ++i) {
    if (std::abs(static_cast<std::int64_t>(m.mantissa(i))) > kMantissaLimit)
      return invalid("radiance.mantissa is larger than 8191");
    sh.c[static_cast<std::size_t>(i / 3)][i % 3] = value_of(m.mantissa(i), m.exponent());
  }
  return {};
}

Status read_light(const v1::Light& m, Light& light) {
  if (m.direction_size() != 3) return invalid("light.direction needs three numbers");
  if (m.irradiance_mantissa_size() != 3) return invalid("light.irradiance_mantissa needs three numbers");
  if (m.direction_covariance_size() != 0 && m.direction_covariance_size() != 3)
    return invalid("light.direction_covariance needs three numbers");
  if (m.irradiance_exponent() < -150 || m.irradiance_exponent() > 100)
    return invalid("light.irradiance_exponent is out of range");
  light.direction = normalized(Vec3f{static_cast<float>(m.direction(0)), static_cast<float>(m.direction(1)),
                                     static_cast<float>(m.direction(2))});
  if (light.direction == Vec3f{}) return invalid("light.direction is zero");
  for (int k = 0; k < 3; ++k) {
    if (std::abs(static_cast<std::int64_t>(m.irradiance_mantissa(k))) > kMantissaLimit)
      return invalid("light.irradiance_mantissa is larger than 8191");
    light.irradiance[k] = value_of(m.irradiance_mantissa(k), m.irradiance_exponent());
  }
  const double radius = m.angular_radius_e5() * kRadiusUnit;
  if (radius > std::numbers::pi / 2 + 2 * kRadiusUnit) return invalid("light.angular_radius_e5 is beyond a quarter turn");
  light.angular_radius_rad = static_cast<float>(std::min(radius, std::numbers::pi / 2));
  for (int k = 0; k < m.direction_covariance_size(); ++k) {
    if (!std::isfinite(m.direction_covariance(k))) return invalid("light.direction_covariance is not finite");
    light.direction_covariance[static_cast<std::size_t>(k)] = m.direction_covariance(k);
  }
  light.track = m.track();
  return {};
}

Status read_environment(const v1::EnvironmentMap& m, EnvironmentMap& map) {
  if (m.encoding() != v1::EnvironmentMap::RGB9E5) return invalid("environment.encoding is not known");
  if (m.edge() != 8 && m.edge() != 16 && m.edge() != 32 && m.edge() != 64)
    return invalid("environment.edge must be 8, 16, 32 or 64");
  if (m.roughness_size() < 1 || m.roughness_size() > 7) return invalid("environment.roughness needs 1 to 7 levels");
  std::size_t texels = 0;
  for (int level = 0; level < m.roughness_size(); ++level) {
    const std::size_t edge = m.edge() >> level;
    if (edge < 1) return invalid("environment has more levels than its edge allows");
    if (!share(m.roughness(level))) return invalid("environment.roughness must be 0 to 1");
    texels += edge * edge;
    map.roughness.push_back(m.roughness(level));
  }
  if (m.texels().size() != 4 * texels) return invalid("environment.texels has not the length its levels need");
  map.edge = static_cast<int>(m.edge());
  map.texels.resize(texels);
  for (std::size_t i = 0; i < texels; ++i) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 4; ++k)
      v |= static_cast<std::uint32_t>(static_cast<unsigned char>(m.texels()[4 * i + k])) << (8 * k);
    map.texels[i] = v;
  }
  return {};
}

}  // namespace

struct Encoder::State {
  v1::LightingDescriptor message;
  std::vector<std::byte> bytes;
};

Encoder::Encoder() : state_(std::make_unique<State>()) {
  // Room for the largest message without a map, so that a lamp more does not allocate.
  state_->bytes.reserve(8192);
  for (std::size_t i = 0; i < kMaxLights; ++i) {
    v1::Light& light = *state_->message.add_lights();
    light.mutable_direction()->Reserve(3);
    light.mutable_irradiance_mantissa()->Reserve(3);
    light.mutable_direction_covariance()->Reserve(3);
  }
  state_->message.mutable_radiance()->mutable_mantissa()->Reserve(3 * sh_count(kMaxBand));
  state_->message.mutable_flags()->Reserve(static_cast<int>(kFlags.size()));
  state_->message.mutable_time();
  state_->message.mutable_bound();
}
Encoder::~Encoder() = default;
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;

Result<std::span<const std::byte>> Encoder::encode(const Descriptor& d) {
  if (const Status s = problem(d); !s.ok()) return s;
  v1::LightingDescriptor& m = state_->message;
  // Part by part: Clear() of the whole would give back the memory of `radiance`, `time` and `bound`.
  m.mutable_radiance()->Clear();
  m.clear_lights();
  m.clear_flags();
  if (m.has_environment()) m.clear_environment();
  m.set_wire_version(kWireVersion);
  m.set_sequence(d.sequence);
  v1::CaptureTime& time = *m.mutable_time();
  time.set_mid_exposure_ns(static_cast<std::uint64_t>(d.time.mid_exposure.ns));
  time.set_clock(v1::CLOCK_PROBE_MONOTONIC);
  time.set_delivered_after_us(microseconds(d.time.delivered_after));
  time.set_encoded_after_us(microseconds(d.time.encoded_after));
  m.set_units(static_cast<v1::Units>(d.units));
  fill_radiance(d.radiance, *m.mutable_radiance());
  for (const Light& light : d.lights) fill_light(light, *m.add_lights());
  if (d.environment) {
    v1::EnvironmentMap& map = *m.mutable_environment();
    map.set_edge(static_cast<std::uint32_t>(d.environment->edge));
    map.set_encoding(v1::EnvironmentMap::RGB9E5);
    std::string& texels = *map.mutable_texels();
    for (const std::uint32_t v : d.environment->texels)
      for (int k = 0; k < 4; ++k) texels.push_back(static_cast<char>(v >> (8 * k) & 255U));
    for (const float r : d.environment->roughness) map.add_roughness(r);
  }
  m.set_coverage(d.coverage);
  m.set_saturated(d.saturated);
  v1::ErrorBound& bound = *m.mutable_bound();
  bound.set_total(d.bound.total);
  bound.set_truncation(d.bound.truncation);
  bound.set_sampling(d.bound.sampling);
  bound.set_noise(d.bound.noise);
  bound.set_quantization(d.bound.quantization);
  m.set_probe_id(d.probe_id);
  m.set_calibration_id(d.calibration_id);
  for (const Flag f : kFlags)
    if (d.flags.has(f)) m.add_flags(static_cast<v1::Flag>(f));
  const std::size_t size = m.ByteSizeLong();
  if (size > kMaxDescriptorBytes) return invalid("larger than 64 KiB");
  state_->bytes.resize(size);
  m.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(state_->bytes.data()));
  return std::span<const std::byte>(state_->bytes);
}

Result<Descriptor> decode_descriptor(std::span<const std::byte> bytes) {
  if (bytes.size() > kMaxDescriptorBytes) return Status(StatusCode::data_loss, "descriptor: longer than 64 KiB");
  v1::LightingDescriptor m;
  if (!m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return Status(StatusCode::data_loss, "descriptor: not a protobuf message");
  if (m.wire_version() != kWireVersion)
    return invalid("wire_version is " + std::to_string(m.wire_version()) + ", this reader knows 1");
  Descriptor d;
  d.sequence = m.sequence();
  if (m.time().clock() != v1::CLOCK_PROBE_MONOTONIC) return invalid("time.clock is not known");
  d.time.mid_exposure = {static_cast<std::int64_t>(m.time().mid_exposure_ns())};
  d.time.delivered_after = {std::int64_t{m.time().delivered_after_us()} * 1000};
  d.time.encoded_after = {std::int64_t{m.time().encoded_after_us()} * 1000};
  if (m.units() != v1::UNITS_RELATIVE && m.units() != v1::UNITS_ABSOLUTE) return invalid("units are not known");
  d.units = static_cast<Units>(m.units());
  if (const Status s = read_radiance(m.radiance(), d.radiance); !s.ok()) return s;
  if (m.lights_size() > static_cast<int>(kMaxLights)) return invalid("more than 64 lights");
  d.lights.resize(static_cast<std::size_t>(m.lights_size()));
  for (int i = 0; i < m.lights_size(); ++i)
    if (const Status s = read_light(m.lights(i), d.lights[static_cast<std::size_t>(i)]); !s.ok()) return s;
  if (m.has_environment()) {
    d.environment.emplace();
    if (const Status s = read_environment(m.environment(), *d.environment); !s.ok()) return s;
  }
  d.coverage = m.coverage();
  d.saturated = m.saturated();
  d.bound = {m.bound().total(), m.bound().truncation(), m.bound().sampling(), m.bound().noise(),
             m.bound().quantization()};
  d.probe_id = m.probe_id();
  d.calibration_id = m.calibration_id();
  for (const int f : m.flags())
    for (const Flag known : kFlags)
      if (f == static_cast<int>(known)) d.flags.set(known);
  if (const Status s = problem(d); !s.ok()) return s;
  return d;
}

Result<std::string> descriptor_to_json(std::span<const std::byte> bytes) {
  v1::LightingDescriptor m;
  if (!m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return Status(StatusCode::data_loss, "descriptor: not a protobuf message");
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.add_whitespace = false;
  std::string json;
  if (const auto s = google::protobuf::util::MessageToJsonString(m, &json, options); !s.ok())
    return Status(StatusCode::internal, s.ToString());
  return json;
}

Result<std::string> descriptor_from_json(std::string_view json) {
  v1::LightingDescriptor m;
  if (const auto s = google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &m); !s.ok())
    return Status(StatusCode::invalid_argument, "descriptor JSON: " + s.ToString());
  return m.SerializeAsString();
}

double wire_error(const Descriptor& d, double rms_irradiance) {
  if (!(rms_irradiance > 0)) return 0;
  // Half a step in every coefficient, each weighed by its lobe (Parseval); for lights half a step of irradiance, and of
  // direction the diagonal of a cell, each times the RMS of a clipped cosine, sqrt(1/6), or of its slope, below 1/2.
  double lobes = 0;
  for (int l = 0; l <= d.radiance.band; ++l) lobes += (2 * l + 1) * cosine_lobe(l) * cosine_lobe(l);
  double error = std::ldexp(0.5, exponent_for(largest_coefficient(d.radiance))) *
                 std::sqrt(lobes / (4 * std::numbers::pi));
  for (const Light& light : d.lights) {
    const float e = largest(light.irradiance);
    error += std::ldexp(0.5, exponent_for(e)) * std::sqrt(1.0 / 6);
    error += e * (std::numbers::sqrt3 / 2 / kDirectionScale) * 0.5;
  }
  return error / rms_irradiance;
}

}  // namespace lightwell
