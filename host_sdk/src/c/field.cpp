// C ABI of LightField, which is in a module (field_module.hpp).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <lightwell/field.h>

#include "c/call.hpp"
#include "c/field_module.hpp"

struct lw_light_field {
  static constexpr std::uint64_t kKind = 0x646c65696674676cU;  // "lgtfield"
  static constexpr const char* kRefusal = "this is not an lw_light_field of lw_light_field_create";

  explicit lw_light_field(std::unique_ptr<lightwell::c::FieldInterface> made) : value(std::move(made)) {}
  lightwell::c::HandleTag tag{kKind};
  std::unique_ptr<lightwell::c::FieldInterface> value;
};

namespace lightwell::c {
namespace {

constexpr std::uint32_t bit(FieldFlag flag) { return 1U << static_cast<unsigned>(flag); }
static_assert(LW_LIGHT_FIELD_ONE_PROBE == bit(FieldFlag::one_probe) &&
              LW_LIGHT_FIELD_FAR_FROM_PROBES == bit(FieldFlag::far_from_probes) &&
              LW_LIGHT_FIELD_CONTRADICTION == bit(FieldFlag::contradiction) &&
              LW_LIGHT_FIELD_AT_LIGHT == bit(FieldFlag::at_light) &&
              LW_LIGHT_FIELD_OCCLUSION_UNKNOWN == bit(FieldFlag::occlusion_unknown) && kFieldFlags.size() == 5);
static_assert(LW_LIGHT_FIELD_USED == static_cast<int>(FieldProbeState::used) &&
              LW_LIGHT_FIELD_STALE == static_cast<int>(FieldProbeState::stale) &&
              LW_LIGHT_FIELD_EXPIRED == static_cast<int>(FieldProbeState::expired) &&
              LW_LIGHT_FIELD_WRONG_CLOCK == static_cast<int>(FieldProbeState::wrong_clock) &&
              LW_LIGHT_FIELD_WRONG_POSE == static_cast<int>(FieldProbeState::wrong_pose) &&
              LW_LIGHT_FIELD_WRONG_SCALE == static_cast<int>(FieldProbeState::wrong_scale) &&
              LW_LIGHT_FIELD_CONTRADICTED == static_cast<int>(FieldProbeState::contradicted));

template <class T>
void put(Vec3<T> v, T (&out)[3]) {
  std::ranges::copy(std::array{v.x, v.y, v.z}, out);
}

lw_light_field_light as_c(const FieldLight& light) {
  lw_light_field_light out{};
  out.id = light.id;
  out.placed = light.placed ? 1 : 0;
  out.probes = light.probes;
  put(light.position, out.position);
  std::ranges::copy(light.position_covariance, out.position_covariance);
  put(light.direction, out.direction);
  out.direction_sigma = light.direction_sigma_rad;
  for (int c = 0; c < 3; ++c) out.intensity[c] = light.intensity[c];
  for (int i = 0; i < 9; ++i)
    out.intensity_gradient[i] = light.intensity_gradient[static_cast<std::size_t>(i / 3)][i % 3];
  out.radius = light.radius;
  return out;
}

lw_light_field_probe as_c(const FieldProbe& probe) {
  lw_light_field_probe out{};
  out.state = static_cast<lw_light_field_probe_state>(probe.state);
  put(probe.position, out.position);
  out.scale = probe.scale;
  out.lights = probe.lights;
  out.matched = probe.matched;
  out.ambiguous = probe.ambiguous;
  return out;
}

lw_light_field_answer as_c(const FieldAnswer& answer) {
  lw_light_field_answer out{};
  out.validity = static_cast<lw_validity>(answer.light.validity());
  out.age_ns = answer.light.age().ns;
  out.error_bound = answer.light.descriptor().bound.total;
  out.flags = bits_of(answer.light.descriptor().flags);
  for (const FieldFlag flag : kFieldFlags)
    if (answer.flags.has(flag)) out.field_flags |= bit(flag);
  out.nearest_probe = answer.nearest_probe_m;
  return out;
}

Status name_of(const char* name, std::size_t length, std::string_view& out) {
  if (name == nullptr) return null_argument("name");
  out = length == LW_ZERO_TERMINATED ? std::string_view(name) : std::string_view(name, length);
  return {};
}

/// The size of an element of an array of structs that the library fills.
Status element_size(std::size_t size, const char* name) {
  if (size >= 2 * sizeof(std::uint32_t) && size <= kMaxStructSize) return {};
  return invalid("the size of an element is " + std::to_string(size) + "; it is sizeof(" + name + ")");
}

/// Element i of the array; sets its `size`.
template <class T>
Status put_element(const T& from, const char* name, void* array, std::size_t i, std::size_t size) {
  auto* const to = static_cast<unsigned char*>(array) + i * size;
  const auto of = static_cast<std::uint32_t>(size);
  std::memcpy(to, &of, sizeof of);
  return write_sized(from, name, reinterpret_cast<T*>(to));
}

template <class T, class From>
Status put_all(std::span<const From> from, const char* name, T* to, std::size_t size, std::size_t capacity,
               std::size_t* count) {
  if (to == nullptr && capacity > 0) return invalid("the array is NULL, and capacity is not 0");
  if (capacity > 0)
    if (Status s = element_size(size, name); !s.ok()) return s;
  for (std::size_t i = 0; i < std::min(capacity, from.size()); ++i)
    if (Status s = put_element(as_c(from[i]), name, to, i, size); !s.ok()) return s;
  if (count != nullptr) *count = from.size();
  return {};
}

/// Three doubles or floats.
template <class T>
Vec3<T> vector_of(const unsigned char* from) {
  T xyz[3];
  std::memcpy(xyz, from, sizeof xyz);
  return {xyz[0], xyz[1], xyz[2]};
}

Status sample_of(const Lighting& lighting, const lw_light_field_sample& given, FieldSample& out) {
  if (lighting.validity() != Validity::valid && lighting.validity() != Validity::stale)
    return {StatusCode::failed_precondition, "the lighting has no light: " + lighting.reason()};
  if (given.position_sigma < 0 || given.orientation_sigma < 0)
    return invalid("a sigma of lw_light_field_sample is below zero");
  out.light = lighting.descriptor();
  out.T_world_probe.pose = pose_of(given.position, given.orientation);
  for (std::size_t i = 0; i < 6; ++i) {
    const double sigma = i < 3 ? given.orientation_sigma : given.position_sigma;
    out.T_world_probe.covariance[i][i] = sigma * sigma;
  }
  out.mid_exposure = given.mid_exposure_ns != 0 ? HostTime{given.mid_exposure_ns} : lighting.mid_exposure();
  out.time_uncertainty = lighting.age_uncertainty();
  return {};
}

struct Receivers {
  const unsigned char* positions = nullptr;
  const unsigned char* normals = nullptr;
  std::size_t count = 0, position_stride = 0, normal_stride = 0;
};

Status answer_receivers(const FieldInterface& field, HostTime now, const Receivers& receivers, unsigned char* values,
                        std::size_t value_stride, lw_light_field_answer* answers, std::size_t answer_size) {
  FieldAnswer here;
  Vec3d place;
  for (std::size_t i = 0; i < receivers.count; ++i) {
    const Vec3d position = vector_of<double>(receivers.positions + i * receivers.position_stride);
    if (i == 0 || !(position == place)) here = field.at(position, now);
    place = position;
    const auto e = here.light.irradiance(vector_of<float>(receivers.normals + i * receivers.normal_stride));
    const float rgb[3] = {e.value.r, e.value.g, e.value.b};
    std::memcpy(values + i * value_stride, rgb, sizeof rgb);
    if (answers == nullptr) continue;
    lw_light_field_answer about = as_c(here);
    about.validity = static_cast<lw_validity>(e.validity);
    if (Status s = put_element(about, "lw_light_field_answer", answers, i, answer_size); !s.ok()) return s;
  }
  return {};
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_light_field_create(const lw_light_field_options* options, lw_light_field** out) {
  return call([&]() -> Status {
    if (out == nullptr) return invalid("out is NULL; pass the address of a pointer for the field");
    lw_light_field_options given{};
    if (options != nullptr)
      if (Status s = read_sized(options, "lw_light_field_options", given); !s.ok()) return s;
    FieldOptions parsed;
    if (given.max_age_ns != 0) parsed.max_age = {given.max_age_ns};
    if (given.drop_age_ns != 0) parsed.drop_age = {given.drop_age_ns};
    if (given.typical_distance != 0) parsed.typical_distance_m = given.typical_distance;
    const Result<const FieldEntry*>& module = field_module();
    if (!module.ok()) return module.status();
    Result<std::unique_ptr<FieldInterface>> made = (*module)->make(parsed);
    if (!made.ok()) return made.status();
    *out = std::make_unique<lw_light_field>(std::move(*made)).release();
    return {};
  });
}

void lw_light_field_release(lw_light_field* field) {
  if (good(field)) delete field;
}

lw_status lw_light_field_set(lw_light_field* field, const char* name, size_t name_length, const lw_lighting* lighting,
                             const lw_light_field_sample* sample) {
  return with_handle(field, [&](auto& to) -> Status {
    if (!good(lighting)) return invalid(lw_lighting::kRefusal);
    std::string_view text;
    if (Status s = name_of(name, name_length, text); !s.ok()) return s;
    lw_light_field_sample given{};
    if (Status s = read_sized(sample, "lw_light_field_sample", given); !s.ok()) return s;
    FieldSample made;
    if (Status s = sample_of(lighting->value, given, made); !s.ok()) return s;
    return to->set(text, std::move(made));
  });
}

lw_status lw_light_field_remove(lw_light_field* field, const char* name, size_t name_length) {
  return with_handle(field, [&](auto& from) -> Status {
    std::string_view text;
    if (Status s = name_of(name, name_length, text); !s.ok()) return s;
    return from->remove(text) ? Status() : Status(StatusCode::not_found, "the field has no probe of this name");
  });
}

lw_status lw_light_field_set_geometry(lw_light_field* field, const void* vertices, size_t vertex_stride,
                                      size_t vertex_count, const uint32_t* indices, size_t index_count) {
  return with_handle(field, [&](auto& to) -> Status {
    std::size_t stride = 0;
    if (Status s = stride_of(vertex_stride, "vertex_stride", stride); !s.ok()) return s;
    if (vertices == nullptr && vertex_count > 0) return invalid("vertices is NULL, and vertex_count is not 0");
    if (indices == nullptr && index_count > 0) return invalid("indices is NULL, and index_count is not 0");
    std::vector<Vec3f> packed(vertex_count);
    for (std::size_t i = 0; i < vertex_count; ++i)
      packed[i] = vector_of<float>(static_cast<const unsigned char*>(vertices) + i * stride);
    return to->set_geometry({packed, std::span(indices, index_count)});
  });
}

lw_status lw_light_field_update(lw_light_field* field, int64_t now_ns, lw_light_field_state* state) {
  return with_handle(field, [&](auto& of) -> Status {
    std::uint32_t size = 0;
    if (state != nullptr)
      if (Status s = size_of(state, "lw_light_field_state", size); !s.ok()) return s;
    of->update({now_ns});
    if (state == nullptr) return {};
    const auto made = of->state();
    lw_light_field_state out{};
    out.light_count = static_cast<std::uint32_t>(made->lights.size());
    out.probe_count = static_cast<std::uint32_t>(made->probes.size());
    out.units = static_cast<lw_units>(made->units);
    out.updates = made->updates;
    return write_sized(out, "lw_light_field_state", state);
  });
}

lw_status lw_light_field_lights(const lw_light_field* field, lw_light_field_light* lights, size_t light_size,
                                size_t capacity, size_t* count) {
  return with_handle(field, [&](const auto& of) {
    const auto state = of->state();
    return put_all<lw_light_field_light, FieldLight>(state->lights, "lw_light_field_light", lights, light_size,
                                                     capacity, count);
  });
}

lw_status lw_light_field_probes(const lw_light_field* field, lw_light_field_probe* probes, size_t probe_size,
                                size_t capacity, size_t* count) {
  return with_handle(field, [&](const auto& of) {
    const auto state = of->state();
    return put_all<lw_light_field_probe, FieldProbe>(state->probes, "lw_light_field_probe", probes, probe_size,
                                                     capacity, count);
  });
}

lw_status lw_light_field_probe_text(const lw_light_field* field, size_t index, lw_light_field_text_kind kind,
                                    char* text, size_t capacity, size_t* length) {
  return with_handle(field, [&](const auto& of) -> Status {
    const auto state = of->state();
    if (index >= state->probes.size())
      return {StatusCode::not_found, "the field has " + std::to_string(state->probes.size()) + " probes"};
    if (kind != LW_LIGHT_FIELD_NAME && kind != LW_LIGHT_FIELD_REASON)
      return invalid("the text " + std::to_string(kind) + " of a field's probe is not known");
    const FieldProbe& probe = state->probes[index];
    return copy_text(kind == LW_LIGHT_FIELD_NAME ? probe.name : probe.reason, text, capacity, length);
  });
}

lw_status lw_light_field_at(const lw_light_field* field, const double* position, int64_t now_ns, lw_lighting* into,
                            lw_light_field_answer* about) {
  const lw_status status = with_handle(field, [&](const auto& of) -> Status {
    if (position == nullptr) return null_argument("position");
    if (into != nullptr && !good(into)) return not_to_be_filled<lw_lighting>();
    FieldAnswer answer = of->at({position[0], position[1], position[2]}, {now_ns});
    if (about != nullptr)
      if (Status s = write_sized(as_c(answer), "lw_light_field_answer", about); !s.ok()) return s;
    if (into != nullptr) into->value = std::move(answer.light);
    return {};
  });
  return write_failure(status, "lw_light_field_answer", about);
}

lw_status lw_light_field_irradiance(const lw_light_field* field, const void* positions, size_t position_stride,
                                    const void* normals, size_t normal_stride, size_t count, int64_t now_ns,
                                    float* values, size_t value_stride, lw_light_field_answer* answers,
                                    size_t answer_size) {
  return with_handle(field, [&](const auto& of) -> Status {
    if (count > 0 && (positions == nullptr || normals == nullptr || values == nullptr))
      return invalid("the positions, normals or values are NULL, and count is not 0");
    constexpr std::size_t kDoubles = 3 * sizeof(double);
    if (position_stride != 0 && position_stride < kDoubles)
      return invalid("position_stride is " + std::to_string(position_stride) + "; it is in bytes, 24 or more, or 0");
    Receivers receivers{static_cast<const unsigned char*>(positions), static_cast<const unsigned char*>(normals), count,
                        position_stride == 0 ? kDoubles : position_stride, 0};
    if (Status s = stride_of(normal_stride, "normal_stride", receivers.normal_stride); !s.ok()) return s;
    std::size_t to_stride = 0;
    if (Status s = stride_of(value_stride, "value_stride", to_stride); !s.ok()) return s;
    if (answers != nullptr)
      if (Status s = element_size(answer_size, "lw_light_field_answer"); !s.ok()) return s;
    return answer_receivers(*of, {now_ns}, receivers, reinterpret_cast<unsigned char*>(values), to_stride, answers,
                            answer_size);
  });
}

}  // extern "C"
