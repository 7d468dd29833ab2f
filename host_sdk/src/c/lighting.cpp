// C ABI of Lighting: lifetime, properties, queries.
#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <span>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/lighting.hpp>

#include "c/call.hpp"
#include "c/result_conversion.hpp"
#include "c/sized.hpp"

namespace lightwell::c {
namespace {

constexpr std::size_t kTriple = 3 * sizeof(float);
constexpr Vec3f kUp{0, 1, 0};

Vec3f vector_at(const void* from) {
  float xyz[3];
  std::memcpy(xyz, from, sizeof xyz);
  return {xyz[0], xyz[1], xyz[2]};
}

/// Stride in bytes; 0 means tightly packed. invalid_argument if the entries would overlap.
Status stride_of(std::size_t given, const char* name, std::size_t& stride) {
  stride = given == 0 ? kTriple : given;
  if (stride >= kTriple) return {};
  return invalid(std::string(name) + " is " + std::to_string(given) + "; it is in bytes, 12 or more, or 0");
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

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_lighting_create(lw_lighting** out) {
  return call([&]() -> Status {
    if (out == nullptr) return invalid("out is NULL; pass the address of a pointer for the lighting");
    *out = std::make_unique<lw_lighting>().release();
    return {};
  });
}

void lw_lighting_release(lw_lighting* lighting) {
  if (good(lighting)) delete lighting;
}

lw_status lw_lighting_copy(const lw_lighting* lighting, lw_lighting* into) {
  return with_lighting(lighting, [&](const Lighting& from) {
    if (!good(into)) return invalid("`into` is not an lw_lighting of lw_lighting_create");
    into->value = from;
    return Status{};
  });
}

lw_status lw_lighting_decode(const void* bytes, size_t length, int64_t age_ns, lw_lighting* into) {
  return into_lighting(into, [&](Lighting& to) -> Status {
    if (bytes == nullptr && length > 0) return invalid("bytes is NULL, and length is not 0");
    if (age_ns < 0) return invalid("age_ns is below zero");
    Result<Descriptor> d = decode_descriptor({static_cast<const std::byte*>(bytes), length});
    if (!d.ok()) return d.status();
    to = Lighting::of(std::move(*d), {age_ns});
    return {};
  });
}

lw_status lw_lighting_rotated(const lw_lighting* lighting, const double* q, lw_lighting* into) {
  return with_lighting(lighting, [&](const Lighting& from) {
    if (!good(into)) return invalid("`into` is not an lw_lighting of lw_lighting_create");
    if (q == nullptr) return invalid("q is NULL; it is a quaternion x, y, z, w");
    into->value = from.rotated({q[0], q[1], q[2], q[3]});
    return Status{};
  });
}

lw_status lw_lighting_get_info(const lw_lighting* lighting, lw_lighting_info* out) {
  return write_failure(
      with_lighting(lighting, [&](const Lighting& l) { return write_sized(as_c(l), "lw_lighting_info", out); }),
      "lw_lighting_info", out);
}

lw_status lw_lighting_reason(const lw_lighting* lighting, char* text, size_t capacity, size_t* length) {
  return with_lighting(lighting, [&](const Lighting& l) { return copy_text(l.reason(), text, capacity, length); });
}

lw_status lw_lighting_irradiance(const lw_lighting* lighting, const float* normal, lw_answer* out) {
  const lw_status status = with_lighting(lighting, [&](const Lighting& l) {
    if (normal == nullptr) return invalid("normal is NULL");
    return write_sized(as_c(l.irradiance(vector_at(normal)), l.units()), "lw_answer", out);
  });
  return write_failure(status, "lw_answer", out);
}

lw_status lw_lighting_radiance(const lw_lighting* lighting, const float* direction, float roughness, lw_answer* out) {
  const lw_status status = with_lighting(lighting, [&](const Lighting& l) {
    if (direction == nullptr) return invalid("direction is NULL");
    return write_sized(as_c(l.radiance(vector_at(direction), roughness), l.units()), "lw_answer", out);
  });
  return write_failure(status, "lw_answer", out);
}

lw_status lw_lighting_irradiance_batch(const lw_lighting* lighting, const float* normals, size_t normal_stride,
                                       size_t count, float* values, size_t value_stride, lw_answer* about) {
  const lw_status status = with_lighting(lighting, [&](const Lighting& l) {
    const lw_answer one = as_c(l.irradiance(kUp), l.units());
    return answer_batch<Irradiance>(
        one, {normals, normal_stride, count, values, value_stride}, about,
        [&](std::span<const Vec3f> n, std::span<Irradiance> out) { return l.irradiance(n, out).value; });
  });
  return write_failure(status, "lw_answer", about);
}

lw_status lw_lighting_radiance_batch(const lw_lighting* lighting, const float* directions, size_t direction_stride,
                                     size_t count, float roughness, float* values, size_t value_stride,
                                     lw_answer* about) {
  const lw_status status = with_lighting(lighting, [&](const Lighting& l) {
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
  return write_failure(status, "lw_answer", about);
}

lw_status lw_lighting_harmonics(const lw_lighting* lighting, lw_quantity quantity, int32_t max_band,
                                float* coefficients, int32_t* band) {
  return with_lighting(lighting, [&](const Lighting& l) {
    if (coefficients == nullptr) return invalid("coefficients is NULL");
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
  return with_lighting(lighting, [&](const Lighting& l) -> Status {
    if (lights == nullptr && capacity > 0) return invalid("lights is NULL, and capacity is not 0");
    if (capacity > 0 && (light_size < 2 * sizeof(std::uint32_t) || light_size > kMaxStructSize))
      return invalid("light_size is " + std::to_string(light_size) + "; it is sizeof(lw_light)");
    auto* to = reinterpret_cast<unsigned char*>(lights);
    for (std::size_t i = 0; i < std::min(capacity, l.lights().size()); ++i, to += light_size) {
      const auto size = static_cast<std::uint32_t>(light_size);
      std::memcpy(to, &size, sizeof size);
      if (Status s = write_sized(as_c(l.lights()[i]), "lw_light", reinterpret_cast<lw_light*>(to)); !s.ok()) return s;
    }
    if (count != nullptr) *count = l.lights().size();
    return {};
  });
}

}  // extern "C"
