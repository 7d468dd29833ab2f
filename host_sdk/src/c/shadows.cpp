// C ABI of ShadowCaster.
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <lightwell/shadows.h>
#include <lightwell/shadows.hpp>

#include "c/call.hpp"
#include "c/mesh_memory.hpp"

namespace lightwell::c {

/// The caster, and vertices copied from memory of any stride.
struct CasterMemory {
  ShadowCaster caster;
  std::vector<Vec3f> positions;
};

}  // namespace lightwell::c

struct lw_shadow_caster {
  static constexpr std::uint64_t kKind = 0x776f64616873776cU;  // "lwshadow"
  static constexpr const char* kRefusal = "this is not an lw_shadow_caster of lw_shadow_caster_create";

  explicit lw_shadow_caster(lightwell::ShadowCaster made) : value{std::move(made), {}} {}
  lightwell::c::HandleTag tag{kKind};
  lightwell::c::CasterMemory value;
};

namespace lightwell::c {
namespace {

// Ratios are written in place.
static_assert(sizeof(LightRatio) == 3 * sizeof(float) && std::is_standard_layout_v<LightRatio>);

lw_shadow_summary as_c(const Answer<ShadowSummary>& answer) {
  auto out = start_answer<lw_shadow_summary>(answer);
  out.no_light = answer.value.no_light ? 1 : 0;
  out.lights = answer.value.lights;
  out.directions = answer.value.directions;
  out.ignored_triangles = answer.value.ignored_triangles;
  return out;
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_shadow_caster_create(const lw_shadow_options* options, lw_shadow_caster** out) {
  return call([&]() -> Status {
    if (out == nullptr) return invalid("out is NULL; pass the address of a pointer for the caster");
    lw_shadow_options given{};
    if (options != nullptr)
      if (Status s = read_sized(options, "lw_shadow_options", given); !s.ok()) return s;
    ShadowOptions parsed;
    if (given.light_samples != 0) parsed.light_samples = given.light_samples;
    if (given.residual_directions != 0) parsed.residual_directions = given.residual_directions;
    if (given.residual_cell != 0) parsed.residual_cell = given.residual_cell;
    Result<ShadowCaster> made = ShadowCaster::make(parsed);
    if (!made.ok()) return made.status();
    *out = std::make_unique<lw_shadow_caster>(std::move(*made)).release();
    return {};
  });
}

void lw_shadow_caster_release(lw_shadow_caster* caster) {
  if (good(caster)) delete caster;
}

lw_status lw_shadow_caster_cast(lw_shadow_caster* caster, const lw_lighting* lighting,
                                const lw_shadow_receiver* receiver, const lw_shadow_mesh* mesh, float* ratios,
                                size_t capacity, lw_shadow_summary* summary) {
  const lw_status status = with_handle(lighting, [&](const Lighting& light) -> Status {
    if (!good(caster)) return invalid(lw_shadow_caster::kRefusal);
    lw_shadow_receiver plane{};
    if (Status s = read_sized(receiver, "lw_shadow_receiver", plane); !s.ok()) return s;
    std::uint32_t size = 0;
    if (summary != nullptr)
      if (Status s = size_of(summary, "lw_shadow_summary", size); !s.ok()) return s;
    ShadowReceiver to{pose_of(plane.position, plane.orientation), plane.width, plane.height};
    if (plane.columns != 0) to.columns = plane.columns;
    if (plane.rows != 0) to.rows = plane.rows;
    if (Status s = to.validate(); !s.ok()) return s;
    const std::size_t texels = static_cast<std::size_t>(to.columns) * static_cast<std::size_t>(to.rows);
    if (ratios == nullptr || capacity < 3 * texels)
      return invalid("the ratios need room for " + std::to_string(3 * texels) + " numbers");
    ShadowMesh from;
    if (Status s = mesh_of(mesh, caster->value.positions, from); !s.ok()) return s;
    const auto answer =
        caster->value.caster.cast(light, to, from, std::span(reinterpret_cast<LightRatio*>(ratios), texels));
    if (!answer.ok()) return answer.status();
    return summary == nullptr ? Status() : write_sized(as_c(*answer), "lw_shadow_summary", summary);
  });
  return write_failure(status, "lw_shadow_summary", summary);
}

}  // extern "C"
