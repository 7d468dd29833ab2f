#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <google/protobuf/util/json_util.h>

#include <lightwell/bytes.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/lobes.hpp>

#include "block_float.hpp"
#include "lightwell/v1/descriptor.pb.h"
#include "wire_covariance.hpp"
#include "wire_position.hpp"

namespace lightwell {
namespace {

/// Largest magnitude that takes at most two bytes as a zigzag varint.
constexpr std::int32_t kMantissaLimit = 8191;
constexpr float kDirectionScale = 8191;
constexpr double kRadiusUnit = 1e-5;
constexpr std::uint32_t kInfiniteBound = 0xFFFFFFFF;

Status invalid(const std::string& what) { return invalid_argument("descriptor: " + what); }

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

/// invalid_argument for values that the wire format cannot hold or the specification forbids.
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
    if (Status s = distance_problem(light); !s.ok()) return s;
  }
  if (Status s = origin_problem(d.T_probe_origin); !s.ok()) return s;
  if (!share(d.coverage)) return invalid("coverage must be 0 to 1");
  if (!share(d.saturated)) return invalid("saturated must be 0 to 1");
  for (const float v :
       {d.bound.total, d.bound.truncation, d.bound.sampling, d.bound.noise, d.bound.quantization, d.bound.smoothing})
    if (!(v >= 0)) return invalid("a part of the bound is negative or NaN");
  if (to_string(d.setting) == "unknown") return invalid("setting is not known");
  if (d.environment) return environment_problem(*d.environment);
  return {};
}

/// Number of trailing zero bits that all mantissas have in common, which can be moved to the exponent. Smaller
/// mantissas are shorter varints, so coarser steps save bytes. 0 if all mantissas are zero.
int common_zeros(std::uint32_t all_bits) { return all_bits == 0 ? 0 : std::countr_zero(all_bits); }

int radiance_exponent(const Descriptor& d) {
  const int finest = exponent_for(largest_coefficient(d.radiance), kMantissaLimit);
  if (!(d.radiance_step > 0) || !std::isfinite(d.radiance_step)) return finest;
  int k = 0;
  std::frexp(d.radiance_step, &k);  // step = f 2^k with f in [1/2, 1)
  return std::max(finest, k - 1);
}

void fill_radiance(const Descriptor& d, v1::SphericalHarmonics& m) {
  const RadianceSh& sh = d.radiance;
  const int exponent = radiance_exponent(d);
  std::array<std::array<std::int32_t, 3>, sh_count(kMaxBand)> mantissas;
  std::uint32_t bands = 1, all_bits = 0;
  for (int l = 0; l <= sh.band; ++l)
    for (int i = l * l; i < sh_count(l); ++i)
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(i);
        const std::int32_t mantissa = mantissa_of(sh.c[at][k], exponent);
        mantissas[at][static_cast<std::size_t>(k)] = mantissa;
        all_bits |= static_cast<std::uint32_t>(std::abs(mantissa));
        if (mantissa != 0) bands |= 1U << l;
      }
  const int zeros = common_zeros(all_bits);
  m.set_bands(bands);
  m.set_exponent(all_bits == 0 ? 0 : exponent + zeros);
  for (int l = 0; l <= sh.band; ++l) {
    if ((bands >> l & 1U) == 0) continue;
    for (int i = l * l; i < sh_count(l); ++i)
      for (const std::int32_t mantissa : mantissas[static_cast<std::size_t>(i)])
        m.add_mantissa(mantissa / (1 << zeros));
  }
}

void fill_light(const Light& light, v1::Light& m) {
  for (const float v : {light.direction.x, light.direction.y, light.direction.z})
    m.add_direction(static_cast<std::int32_t>(std::nearbyint(v * kDirectionScale)));
  const int exponent = exponent_for(largest(light.irradiance), kMantissaLimit);
  std::uint32_t all_bits = 0;
  for (int k = 0; k < 3; ++k)
    all_bits |= static_cast<std::uint32_t>(std::abs(mantissa_of(light.irradiance[k], exponent)));
  const int zeros = common_zeros(all_bits);
  for (int k = 0; k < 3; ++k) m.add_irradiance_mantissa(mantissa_of(light.irradiance[k], exponent) / (1 << zeros));
  m.set_irradiance_exponent(all_bits == 0 ? 0 : exponent + zeros);
  m.set_angular_radius_e5(static_cast<std::uint32_t>(std::lround(light.angular_radius_rad / kRadiusUnit)));
  const auto& cov = light.direction_covariance;
  if (const WireCovariance sent = round_covariance(cov); sent.mantissa != decltype(sent.mantissa){}) {
    const bool isotropic = cov[0] == cov[2] && cov[1] == 0;
    for (std::size_t k = 0; k < (isotropic ? 1 : cov.size()); ++k) m.add_covariance_mantissa(sent.mantissa[k]);
    m.set_covariance_exponent(sent.exponent);
  }
  m.set_track(light.track);
  fill_distance(light, m);
}

std::uint32_t millionths(float v) {
  const double ppm = std::ceil(v * 1e6 * (1 - 1e-7));
  return ppm < kInfiniteBound ? static_cast<std::uint32_t>(ppm) : kInfiniteBound;
}

float of_millionths(std::uint32_t v) {
  return v == kInfiniteBound ? std::numeric_limits<float>::infinity() : static_cast<float>(v * 1e-6);
}

std::uint32_t microseconds(Duration d) {
  const std::int64_t us = d.ns / 1000;
  return us <= 0 ? 0 : us > 0xFFFFFFFF ? 0xFFFFFFFFU : static_cast<std::uint32_t>(us);
}

Status read_radiance(const v1::SphericalHarmonics& m, RadianceSh& sh) {
  if (m.bands() >= 1U << (kMaxBand + 1)) return invalid("radiance.bands has a band above 6");
  int needed = 0;
  for (int l = 0; l <= kMaxBand; ++l)
    if ((m.bands() >> l & 1U) != 0) needed += 3 * (2 * l + 1);
  if (m.mantissa_size() != needed)
    return invalid("radiance.mantissa has " + std::to_string(m.mantissa_size()) + " numbers, its bands need " +
                   std::to_string(needed));
  sh.band = m.bands() == 0 ? 0 : std::bit_width(m.bands()) - 1;
  // 2^100 times 8191 is within the range of float.
  if (m.exponent() < kMinBlockExponent || m.exponent() > kMaxBlockExponent)
    return invalid("radiance.exponent is out of range");
  int next = 0;
  for (int l = 0; l <= sh.band; ++l) {
    if ((m.bands() >> l & 1U) == 0) continue;
    for (int i = 3 * l * l; i < 3 * sh_count(l); ++i, ++next) {
      if (std::abs(static_cast<std::int64_t>(m.mantissa(next))) > kMantissaLimit)
        return invalid("radiance.mantissa is larger than 8191");
      sh.c[static_cast<std::size_t>(i / 3)][i % 3] = value_of(m.mantissa(next), m.exponent());
    }
  }
  return {};
}

Status read_light(const v1::Light& m, Light& light) {
  if (m.direction_size() != 3) return invalid("light.direction needs three numbers");
  if (m.irradiance_mantissa_size() != 3) return invalid("light.irradiance_mantissa needs three numbers");
  if (const int n = m.covariance_mantissa_size(); n != 0 && n != 1 && n != 3)
    return invalid("light.covariance_mantissa needs three numbers, one or none");
  if (m.covariance_exponent() < kMinBlockExponent || m.covariance_exponent() > kMaxBlockExponent)
    return invalid("light.covariance_exponent is out of range");
  if (m.irradiance_exponent() < kMinBlockExponent || m.irradiance_exponent() > kMaxBlockExponent)
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
  if (radius > std::numbers::pi / 2 + 2 * kRadiusUnit) return invalid("light.angular_radius_e5 is above pi/2");
  light.angular_radius_rad = static_cast<float>(std::min(radius, std::numbers::pi / 2));
  WireCovariance covariance{{}, m.covariance_exponent()};
  for (int k = 0; k < m.covariance_mantissa_size(); ++k) {
    if (std::abs(static_cast<std::int64_t>(m.covariance_mantissa(k))) > kCovarianceLimit)
      return invalid("light.covariance_mantissa is larger than 63");
    covariance.mantissa[static_cast<std::size_t>(k)] = m.covariance_mantissa(k);
  }
  if (m.covariance_mantissa_size() == 1) covariance.mantissa[2] = covariance.mantissa[0];
  light.direction_covariance = covariance_of(covariance);
  light.track = m.track();
  return read_distance(m, light);
}

void pack_texels(std::span<const std::uint32_t> texels, std::string& out) {
  out.resize(4 * texels.size());
  for (std::size_t i = 0; i < texels.size(); ++i) put_le(&out[4 * i], texels[i]);
}

/// `name`: of the field.
Status unpack_texels(const std::string& bytes, const char* name, std::vector<std::uint32_t>& out) {
  if (bytes.size() % 4 != 0)
    return invalid("environment." + std::string(name) + ": the length is not a multiple of 4 bytes");
  out.resize(bytes.size() / 4);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = get_le<std::uint32_t>(&bytes[4 * i]);
  return {};
}

/// Reserves memory for the largest map, so that fill_environment() allocates nothing.
void reserve_environment(v1::EnvironmentMap& m) {
  for (std::size_t k = 0; k < kMaxEnvironmentLevels; ++k) m.add_levels();
  m.mutable_texels()->reserve(4 * kMaxEnvironmentTexels);
  m.mutable_runs()->Reserve(static_cast<int>(kMaxEnvironmentTexels));
  constexpr std::size_t kFirstLevel = kMaxEnvironmentEdge * kMaxEnvironmentEdge;
  m.mutable_light_tracks()->Reserve(static_cast<int>(kMaxLights));
  m.mutable_light_runs()->Reserve(static_cast<int>(kFirstLevel));
  m.mutable_light_texels()->reserve(4 * kFirstLevel);
  m.Clear();
}

void fill_environment(const EnvironmentMap& map, v1::EnvironmentMap& m) {
  m.Clear();
  m.set_key(map.key);
  m.set_encoding(v1::EnvironmentMap::RGB9E5);
  for (const EnvironmentLevel& level : map.levels) {
    v1::EnvironmentMap::Level& out = *m.add_levels();
    out.set_edge(static_cast<std::uint32_t>(level.edge));
    out.set_roughness(level.roughness);
  }
  m.set_exponent(map.exponent);
  m.set_key_interval_ms(map.key_interval_ms);
  pack_texels(map.texels, *m.mutable_texels());
  m.mutable_runs()->Add(map.runs.begin(), map.runs.end());
  m.mutable_light_tracks()->Add(map.light_tracks.begin(), map.light_tracks.end());
  m.mutable_light_runs()->Add(map.light_runs.begin(), map.light_runs.end());
  pack_texels(map.light_texels, *m.mutable_light_texels());
}

/// Checks only what the value type cannot represent; environment_problem() checks the rest.
Status read_environment(const v1::EnvironmentMap& m, EnvironmentMap& map) {
  if (m.encoding() != v1::EnvironmentMap::RGB9E5) return invalid("environment.encoding is not known");
  map.key = m.key();
  map.levels.clear();
  for (const v1::EnvironmentMap::Level& level : m.levels()) {
    if (!is_environment_edge(level.edge())) return invalid("environment.levels: an edge must be 8, 16, 32 or 64");
    map.levels.push_back({static_cast<int>(level.edge()), level.roughness()});
  }
  map.exponent = m.exponent();
  map.key_interval_ms = m.key_interval_ms();
  map.runs.assign(m.runs().begin(), m.runs().end());
  map.light_tracks.assign(m.light_tracks().begin(), m.light_tracks().end());
  map.light_runs.assign(m.light_runs().begin(), m.light_runs().end());
  if (const Status s = unpack_texels(m.texels(), "texels", map.texels); !s.ok()) return s;
  return unpack_texels(m.light_texels(), "light_texels", map.light_texels);
}

}  // namespace

struct Encoder::State {
  v1::LightingDescriptor message;
  /// Owned here and attached to `message` only while it is serialised, so that their memory is kept.
  v1::EnvironmentMap environment;
  v1::Pose origin;
  std::vector<std::byte> bytes;
};

Encoder::Encoder() : state_(std::make_unique<State>()) {
  // Reserve the largest message, so that neither another light nor a map allocates.
  state_->bytes.reserve(kMaxDescriptorBytes);
  reserve_environment(state_->environment);
  for (std::size_t i = 0; i < kMaxLights; ++i) {
    v1::Light& light = *state_->message.add_lights();
    light.mutable_direction()->Reserve(3);
    light.mutable_irradiance_mantissa()->Reserve(3);
    light.mutable_covariance_mantissa()->Reserve(3);
  }
  state_->message.mutable_radiance()->mutable_mantissa()->Reserve(3 * sh_count(kMaxBand));
  state_->message.mutable_flags()->Reserve(static_cast<int>(kWireFlags.size()));
  state_->message.mutable_time();
  state_->message.mutable_bound();
}
Encoder::~Encoder() = default;
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;

Result<std::span<const std::byte>> Encoder::encode(const Descriptor& d) {
  if (const Status s = problem(d); !s.ok()) return s;
  v1::LightingDescriptor& m = state_->message;
  // Field by field: Clear() of the whole message would free the memory of `radiance`, `time` and `bound`.
  m.mutable_radiance()->Clear();
  m.clear_lights();
  m.clear_flags();
  m.set_wire_version(kWireVersion);
  m.set_sequence(d.sequence);
  v1::CaptureTime& time = *m.mutable_time();
  time.set_mid_exposure_ns(static_cast<std::uint64_t>(d.time.mid_exposure.ns));
  time.set_clock(v1::CLOCK_PROBE_MONOTONIC);
  time.set_delivered_after_us(microseconds(d.time.delivered_after));
  time.set_encoded_after_us(microseconds(d.time.encoded_after));
  m.set_units(static_cast<v1::Units>(d.units));
  fill_radiance(d, *m.mutable_radiance());
  for (const Light& light : d.lights) fill_light(light, *m.add_lights());
  m.set_unseen(1 - d.coverage);
  m.set_saturated(d.saturated);
  v1::ErrorBound& bound = *m.mutable_bound();
  bound.set_total(millionths(d.bound.total));
  bound.set_truncation(millionths(d.bound.truncation));
  bound.set_sampling(millionths(d.bound.sampling));
  bound.set_noise(millionths(d.bound.noise));
  bound.set_quantization(millionths(d.bound.quantization));
  bound.set_smoothing(millionths(d.bound.smoothing));
  m.set_probe_id(d.probe_id);
  m.set_calibration_id(d.calibration_id);
  for (const Flag f : kWireFlags)
    if (d.flags.has(f)) m.add_flags(static_cast<v1::Flag>(f));
  m.set_setting(static_cast<v1::Setting>(d.setting));
  m.set_flicker(static_cast<v1::Flicker>(d.flicker));
  if (d.environment) {
    fill_environment(*d.environment, state_->environment);
    m.unsafe_arena_set_allocated_environment(&state_->environment);
  }
  const bool elsewhere = d.T_probe_origin != Pose{};
  if (elsewhere) {
    fill_origin(d.T_probe_origin, state_->origin);
    m.unsafe_arena_set_allocated_t_probe_origin(&state_->origin);
  }
  const std::size_t size = m.ByteSizeLong();
  const bool fits = size <= kMaxDescriptorBytes;
  if (fits) {
    state_->bytes.resize(size);
    m.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(state_->bytes.data()));
  }
  if (d.environment) (void)m.unsafe_arena_release_environment();
  if (elsewhere) (void)m.unsafe_arena_release_t_probe_origin();
  if (!fits) return invalid("larger than 64 KiB");
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
  if (Status s = origin_from(m).assign_to(d.T_probe_origin); !s.ok()) return s;
  if (m.has_environment()) {
    d.environment.emplace();
    if (const Status s = read_environment(m.environment(), *d.environment); !s.ok()) return s;
  }
  // Not left to the check of coverage: 1 minus a tiny negative number is 1.
  if (!share(m.unseen())) return invalid("unseen (1 - coverage) must be 0 to 1");
  d.coverage = 1 - m.unseen();
  d.saturated = m.saturated();
  const v1::ErrorBound& bound = m.bound();
  d.bound = {of_millionths(bound.total()), of_millionths(bound.truncation()),   of_millionths(bound.sampling()),
             of_millionths(bound.noise()), of_millionths(bound.quantization()), of_millionths(bound.smoothing())};
  d.probe_id = m.probe_id();
  d.calibration_id = m.calibration_id();
  for (const int f : m.flags()) {
    const auto known =
        std::find_if(kWireFlags.begin(), kWireFlags.end(), [&](Flag k) { return static_cast<int>(k) == f; });
    // An unknown flag still means that the estimate may be wrong; it is decoded as `newer`.
    d.flags.set(known != kWireFlags.end() ? *known : Flag::newer);
  }
  for (const Setting s : kSettings)
    if (m.setting() == static_cast<int>(s)) d.setting = s;
  for (const Flicker f : {Flicker::none, Flicker::hz100, Flicker::hz120})
    if (m.flicker() == static_cast<int>(f)) d.flicker = f;
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
  // Rounding error of each coefficient, weighted by the cosine lobe (Parseval's theorem). For lights, half a step of
  // irradiance times the RMS of the clamped cosine, sqrt(1/6), and the diagonal of a direction cell times the RMS of
  // its slope, below 1/2.
  const int exponent = radiance_exponent(d);
  double squares[3] = {};
  for (int l = 0; l <= d.radiance.band; ++l) {
    const double lobe2 = cosine_lobe(l) * cosine_lobe(l);
    for (int i = l * l; i < sh_count(l); ++i)
      for (int k = 0; k < 3; ++k) {
        const double v = d.radiance.c[static_cast<std::size_t>(i)][k];
        const double lost = v - std::ldexp(std::nearbyint(std::ldexp(v, -exponent)), exponent);
        squares[k] += lobe2 * lost * lost;
      }
  }
  double error = std::sqrt(std::max({squares[0], squares[1], squares[2]}) / (4 * std::numbers::pi));
  for (const Light& light : d.lights) {
    const float e = largest(light.irradiance);
    error += std::ldexp(0.5, exponent_for(e, kMantissaLimit)) * std::sqrt(1.0 / 6);
    error += e * (std::numbers::sqrt3 / 2 / kDirectionScale) * 0.5;
  }
  return error / rms_irradiance;
}

}  // namespace lightwell
