// C ABI of Lighting: lifetime, properties, queries.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/lighting.hpp>

#include "c/call.hpp"

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

template <class T>
lw_answer as_c(const Answer<T>& answer, Units units) {
  auto out = start_answer<lw_answer>(answer);
  for (int k = 0; k < 3; ++k) out.value[k] = answer.value[k];
  out.lights_included = answer.lights == LightsIncluded::yes ? 1 : 0;
  out.units = static_cast<lw_units>(units);
  out.refused = answer.validity == Validity::invalid_query ? 1 : 0;
  return out;
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
  const auto& [q, t] = lighting.origin();
  std::ranges::copy(std::array{t.x, t.y, t.z}, out.origin_position);
  std::ranges::copy(std::array{q.x, q.y, q.z, q.w}, out.origin_orientation);
  return out;
}

lw_light as_c(const Light& light, const std::optional<Vec3d>& position) {
  lw_light out{};
  out.size = sizeof out;
  out.track = light.track;
  std::ranges::copy(std::array{light.direction.x, light.direction.y, light.direction.z}, out.direction);
  for (int k = 0; k < 3; ++k) out.irradiance[k] = light.irradiance[k];
  out.angular_radius = light.angular_radius_rad;
  std::ranges::copy(light.direction_covariance, out.direction_covariance);
  out.distance = light.distance_m;
  out.distance_sigma = light.distance_sigma_m;
  const Vec3f p = vec_cast<float>(position.value_or(Vec3d{}));
  std::ranges::copy(std::array{p.x, p.y, p.z}, out.position);
  return out;
}

lw_environment as_c(const EnvironmentView& view) {
  lw_environment out{};
  out.size = sizeof out;
  out.level_count = static_cast<std::uint32_t>(view.map.levels.size());
  out.sequence = view.sequence;
  out.older_by_ns = view.older_by.ns;
  const Quat& q = view.rotation;
  std::ranges::copy(std::array{q.x, q.y, q.z, q.w}, out.rotation);
  out.key = view.map.key;
  out.exponent = view.map.exponent;
  for (std::size_t k = 0; k < view.map.levels.size(); ++k) {
    out.edge[k] = static_cast<std::uint32_t>(view.map.levels[k].edge);
    out.roughness[k] = view.map.levels[k].roughness;
  }
  return out;
}

/// Writes the texels of a level into `out`, which has room for `capacity` numbers; `each` numbers per texel.
template <class T, class Write>
Status write_level(const Lighting& lighting, std::uint32_t level, T* out, std::size_t capacity, std::size_t each,
                   const Write& write) {
  const std::optional<EnvironmentView> view = lighting.environment();
  const std::size_t levels = view ? view->map.levels.size() : 0;
  if (level >= levels)
    return invalid("unknown level " + std::to_string(level) + ": the map has " + std::to_string(levels));
  const std::span<const EnvironmentLevel> all = view->map.levels;
  const std::size_t first = texel_count(all.first(level)), count = texel_count(all.subspan(level, 1));
  if (out == nullptr || capacity < each * count)
    return invalid("this level needs room for " + std::to_string(each * count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) write(view->map.texels[first + i], view->map.exponent, out + each * i);
  return {};
}

constexpr Vec3f kUp{0, 1, 0};

Vec3f vector_at(const void* from) {
  float xyz[3];
  std::memcpy(xyz, from, sizeof xyz);
  return {xyz[0], xyz[1], xyz[2]};
}

struct Batch {
  const void* inputs = nullptr;
  std::size_t input_stride = 0;
  std::size_t count = 0;
  void* values = nullptr;
  std::size_t value_stride = 0;
};

/// Entries are processed in chunks of this size: copied from memory of any stride and alignment, evaluated with SIMD,
/// and copied back.
constexpr std::size_t kChunk = 256;

/// Evaluates a batch. `query(inputs, values)` evaluates spans of the same length and returns the number of invalid
/// inputs. `one` is the answer to a valid query; everything but its value applies to the whole batch.
template <class Quantity, class Query>
Status answer_batch(const lw_answer& one, Batch batch, lw_answer* about, const Query& query) {
  if (batch.count > 0 && (batch.inputs == nullptr || batch.values == nullptr))
    return invalid("the inputs or the values are NULL, and count is not 0");
  if (Status s = stride_of(batch.input_stride, "the stride of the inputs", batch.input_stride); !s.ok()) return s;
  if (Status s = stride_of(batch.value_stride, "the stride of the values", batch.value_stride); !s.ok()) return s;
  lw_answer summary = one;
  summary.value[0] = summary.value[1] = summary.value[2] = 0;
  summary.refused = 0;
  // Written before the values, so that an invalid struct is detected before anything is written.
  if (about != nullptr)
    if (Status s = write_sized(summary, "lw_answer", about); !s.ok()) return s;
  std::array<Vec3f, kChunk> inputs;
  std::array<Quantity, kChunk> values;
  const auto* from = static_cast<const unsigned char*>(batch.inputs);
  auto* to = static_cast<unsigned char*>(batch.values);
  for (std::size_t done = 0; done < batch.count;) {
    const std::size_t n = std::min(kChunk, batch.count - done);
    for (std::size_t i = 0; i < n; ++i, from += batch.input_stride) inputs[i] = vector_at(from);
    summary.refused +=
        static_cast<std::uint32_t>(query(std::span<const Vec3f>(inputs).first(n), std::span(values).first(n)));
    for (std::size_t i = 0; i < n; ++i, to += batch.value_stride) {
      const float rgb[3] = {values[i].r, values[i].g, values[i].b};
      std::memcpy(to, rgb, sizeof rgb);
    }
    done += n;
  }
  // An error that concerns the whole batch: the roughness, or a lighting rotated by an invalid rotation.
  if (one.validity == LW_INVALID_QUERY) summary.refused = static_cast<std::uint32_t>(batch.count);
  if (summary.refused == 0 || about == nullptr) return {};
  summary.validity = LW_INVALID_QUERY;
  summary.reason = reason_of(Validity::invalid_query);
  return write_sized(summary, "lw_answer", about);
}

template <class Quantity>
void write_coefficients(const Sh<Quantity>& sh, int max_band, float* out) {
  for (int i = 0; i < sh_count(max_band); ++i)
    for (int k = 0; k < 3; ++k) out[3 * i + k] = i < sh.count() ? sh.c[static_cast<std::size_t>(i)][k] : 0;
}

/// Runs `work(lighting)`, which returns a Status; if it fails, fills `out` with an invalid answer.
template <class T, class Work>
lw_status query(const lw_lighting* lighting, const char* name, T* out, const Work& work) {
  return write_failure(with_handle(lighting, work), name, out);
}

}  // namespace

const char* reason_of(Validity validity) {
  constexpr const char* kReasons[] = {"", "the nearest descriptor is, or may be, further away than max_age_ns",
                                      "no descriptor has come yet",
                                      "the time is before the oldest stored descriptor; options.history stores more",
                                      "the direction, roughness or rotation is zero or not finite"};
  return validity <= Validity::invalid_query ? kReasons[static_cast<std::size_t>(validity)] : "unknown";
}

std::uint32_t bits_of(Flags flags) {
  std::uint32_t bits = 0;
  for (const Flag flag : kFlags)
    if (flags.has(flag)) bits |= bit(flag);
  return bits;
}

}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_lighting_create(lw_lighting** out) { return create(out); }

void lw_lighting_release(lw_lighting* lighting) {
  if (good(lighting)) delete lighting;
}

lw_status lw_lighting_copy(const lw_lighting* lighting, lw_lighting* into) {
  return fill(lighting, into, [](const Lighting& from) { return from; });
}

lw_status lw_lighting_decode(const void* bytes, size_t length, int64_t age_ns, lw_lighting* into) {
  return call([&]() -> Status {
    if (!good(into)) return not_to_be_filled<lw_lighting>();
    if (bytes == nullptr && length > 0) return invalid("bytes is NULL, and length is not 0");
    if (age_ns < 0) return invalid("age_ns is below zero");
    Result<Descriptor> d = decode_descriptor({static_cast<const std::byte*>(bytes), length});
    if (d.ok()) into->value = Lighting::of(std::move(*d), {age_ns});
    return d.status();
  });
}

lw_status lw_lighting_rotated(const lw_lighting* lighting, const double* q, lw_lighting* into) {
  return fill(lighting, into, [&](const Lighting& from) -> Result<Lighting> {
    if (q == nullptr) return invalid("q is NULL; it is a quaternion x, y, z, w");
    return from.rotated({q[0], q[1], q[2], q[3]});
  });
}

lw_status lw_lighting_in_world(const lw_lighting* lighting, const double* position, const double* q,
                               lw_lighting* into) {
  return fill(lighting, into, [&](const Lighting& from) -> Result<Lighting> {
    if (position == nullptr || q == nullptr)
      return invalid("position or q is NULL; they are x, y, z and a quaternion x, y, z, w");
    return from.in_world(Pose{{q[0], q[1], q[2], q[3]}, {position[0], position[1], position[2]}});
  });
}

lw_status lw_lighting_get_info(const lw_lighting* lighting, lw_lighting_info* out) {
  return query(lighting, "lw_lighting_info", out,
               [&](const Lighting& l) { return write_sized(as_c(l), "lw_lighting_info", out); });
}

lw_status lw_lighting_reason(const lw_lighting* lighting, char* text, size_t capacity, size_t* length) {
  return with_handle(lighting, [&](const Lighting& l) { return copy_text(l.reason(), text, capacity, length); });
}

lw_status lw_lighting_irradiance(const lw_lighting* lighting, const float* normal, lw_answer* out) {
  return query(lighting, "lw_answer", out, [&](const Lighting& l) {
    if (normal == nullptr) return null_argument("normal");
    return write_sized(as_c(l.irradiance(vector_at(normal)), l.units()), "lw_answer", out);
  });
}

lw_status lw_lighting_radiance(const lw_lighting* lighting, const float* direction, float roughness, lw_answer* out) {
  return query(lighting, "lw_answer", out, [&](const Lighting& l) {
    if (direction == nullptr) return null_argument("direction");
    return write_sized(as_c(l.radiance(vector_at(direction), roughness), l.units()), "lw_answer", out);
  });
}

lw_status lw_lighting_irradiance_batch(const lw_lighting* lighting, const float* normals, size_t normal_stride,
                                       size_t count, float* values, size_t value_stride, lw_answer* about) {
  return query(lighting, "lw_answer", about, [&](const Lighting& l) {
    const lw_answer one = as_c(l.irradiance(kUp), l.units());
    return answer_batch<Irradiance>(
        one, {normals, normal_stride, count, values, value_stride}, about,
        [&](std::span<const Vec3f> n, std::span<Irradiance> out) { return l.irradiance(n, out).value; });
  });
}

lw_status lw_lighting_radiance_batch(const lw_lighting* lighting, const float* directions, size_t direction_stride,
                                     size_t count, float roughness, float* values, size_t value_stride,
                                     lw_answer* about) {
  return query(lighting, "lw_answer", about, [&](const Lighting& l) {
    const lw_answer one = as_c(l.radiance(kUp, roughness), l.units());
    return answer_batch<Radiance>(one, {directions, direction_stride, count, values, value_stride}, about,
                                  [&](std::span<const Vec3f> d, std::span<Radiance> out) {
                                    std::size_t refused = 0;
                                    for (std::size_t i = 0; i < d.size(); ++i) {
                                      const Answer<Radiance> answer = l.radiance(d[i], roughness);
                                      out[i] = answer.value;
                                      if (answer.validity == Validity::invalid_query) ++refused;
                                    }
                                    return refused;
                                  });
  });
}

lw_status lw_lighting_harmonics(const lw_lighting* lighting, lw_quantity quantity, int32_t max_band,
                                float* coefficients, int32_t* band) {
  return with_handle(lighting, [&](const Lighting& l) {
    if (coefficients == nullptr) return null_argument("coefficients");
    if (max_band < 0 || max_band > kMaxBand)
      return invalid("max_band is " + std::to_string(max_band) + "; it is 0 to 6");
    const RadianceSh& sh = l.descriptor().radiance;
    if (quantity == LW_RADIANCE)
      write_coefficients(sh, max_band, coefficients);
    else if (quantity == LW_IRRADIANCE)
      write_coefficients(irradiance_of(sh), max_band, coefficients);
    else
      return invalid("quantity is " + std::to_string(quantity) + "; it is LW_RADIANCE or LW_IRRADIANCE");
    if (band != nullptr) *band = sh.band;
    return Status{};
  });
}

lw_status lw_lighting_lights(const lw_lighting* lighting, lw_light* lights, size_t light_size, size_t capacity,
                             size_t* count) {
  return with_handle(lighting, [&](const Lighting& l) -> Status {
    if (lights == nullptr && capacity > 0) return invalid("lights is NULL, and capacity is not 0");
    if (capacity > 0 && (light_size < 2 * sizeof(std::uint32_t) || light_size > kMaxStructSize))
      return invalid("light_size is " + std::to_string(light_size) + "; it is sizeof(lw_light)");
    auto* to = reinterpret_cast<unsigned char*>(lights);
    for (std::size_t i = 0; i < std::min(capacity, l.lights().size()); ++i, to += light_size) {
      const auto size = static_cast<std::uint32_t>(light_size);
      std::memcpy(to, &size, sizeof size);
      const Light& light = l.lights()[i];
      const lw_light made = as_c(light, l.position(light));
      if (Status s = write_sized(made, "lw_light", reinterpret_cast<lw_light*>(to)); !s.ok()) return s;
    }
    if (count != nullptr) *count = l.lights().size();
    return {};
  });
}

lw_status lw_lighting_environment(const lw_lighting* lighting, lw_environment* out) {
  return with_handle(lighting, [&](const Lighting& l) {
    const std::optional<EnvironmentView> view = l.environment();
    lw_environment none{};
    none.rotation[3] = 1;
    return write_sized(view ? as_c(*view) : none, "lw_environment", out);
  });
}

lw_status lw_lighting_environment_radiance(const lw_lighting* lighting, uint32_t level, float* rgb, size_t capacity) {
  return with_handle(lighting, [&](const Lighting& l) {
    return write_level(l, level, rgb, capacity, 3, [](std::uint32_t texel, int exponent, float* to) {
      const Radiance r = texel_radiance(texel, exponent);
      for (int k = 0; k < 3; ++k) to[k] = r[k];
    });
  });
}

lw_status lw_lighting_environment_texels(const lw_lighting* lighting, uint32_t level, uint32_t* texels,
                                         size_t capacity) {
  return with_handle(lighting, [&](const Lighting& l) {
    return write_level(l, level, texels, capacity, 1, [](std::uint32_t texel, int, std::uint32_t* to) { *to = texel; });
  });
}

}  // extern "C"
