// C ABI of PlaneReflector and PlaneLight.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <lightwell/plane_light.hpp>
#include <lightwell/plane_objects.h>
#include <lightwell/plane_reflection.hpp>

#include "c/mesh_memory.hpp"
#include "c/plane_handle.hpp"

namespace lightwell::c {

/// The reflector, and vertices copied from memory of any stride.
struct ReflectorMemory {
  PlaneReflector reflector;
  std::vector<Vec3f> positions;
};

}  // namespace lightwell::c

struct lw_plane_reflector {
  static constexpr std::uint64_t kKind = 0x6c666572705f776cU;  // "lw_prefl"
  static constexpr const char* kRefusal = "this is not an lw_plane_reflector of lw_plane_reflector_create";

  explicit lw_plane_reflector(lightwell::PlaneReflector made) : value{std::move(made), {}} {}
  lightwell::c::HandleTag tag{kKind};
  lightwell::c::ReflectorMemory value;
};

struct lw_plane_light {
  static constexpr std::uint64_t kKind = 0x7468676c705f776cU;  // "lw_plght"
  static constexpr const char* kRefusal = "this is not an lw_plane_light of lw_plane_light_create";

  lightwell::c::HandleTag tag{kKind};
  lightwell::PlaneLight value;
};

namespace lightwell::c {
namespace {

// Radiances are read and written in place.
static_assert(sizeof(Radiance) == 3 * sizeof(float) && std::is_standard_layout_v<Radiance>);
static_assert(LW_RADIANCE_PER_VERTEX == static_cast<int>(RadiancePer::vertex) &&
              LW_RADIANCE_PER_TRIANGLE == static_cast<int>(RadiancePer::triangle));
static_assert(LW_PLANE_LIGHT_NONE == static_cast<int>(PlaneLightSource::none) &&
              LW_PLANE_LIGHT_TEXTURE == static_cast<int>(PlaneLightSource::texture) &&
              LW_PLANE_LIGHT_DESCRIPTOR == static_cast<int>(PlaneLightSource::descriptor));

Status radiant_mesh_of(const lw_radiant_mesh* given, std::vector<Vec3f>& positions, RadiantMesh& out) {
  lw_radiant_mesh object{};
  if (Status s = read_sized(given, "lw_radiant_mesh", object); !s.ok()) return s;
  if (Status s = mesh_of(object.mesh, positions, out.mesh); !s.ok()) return s;
  if (object.radiance_per != LW_RADIANCE_PER_VERTEX && object.radiance_per != LW_RADIANCE_PER_TRIANGLE)
    return invalid("lw_radiant_mesh.radiance_per is " + std::to_string(object.radiance_per) +
                   "; it is LW_RADIANCE_PER_VERTEX or _TRIANGLE");
  out.per = static_cast<RadiancePer>(object.radiance_per);
  if (object.radiance_count > 0 && object.radiance == nullptr)
    return invalid("lw_radiant_mesh.radiance is NULL, and radiance_count is not 0");
  out.radiance = {reinterpret_cast<const Radiance*>(object.radiance), object.radiance_count};
  return {};
}

Status grid_of(const lw_plane_grid* given, PlaneGrid& out) {
  lw_plane_grid grid{};
  if (Status s = read_sized(given, "lw_plane_grid", grid); !s.ok()) return s;
  out = {{grid.centre[0], grid.centre[1]}, grid.width, grid.height};
  if (grid.columns != 0) out.columns = grid.columns;
  if (grid.rows != 0) out.rows = grid.rows;
  return out.validate();
}

lw_plane_reflection as_c(const PlaneReflection& about) {
  lw_plane_reflection out{};
  out.validity = static_cast<lw_validity>(about.validity);
  out.f0_assumed = about.f0_assumed ? 1 : 0;
  out.ignored_triangles = about.ignored_triangles;
  out.texels = about.texels;
  return out;
}

Status write_light(const PlaneLightAnswer& answer, lw_plane_light_answer* to) {
  lw_plane_light_answer out{};
  out.validity = static_cast<lw_validity>(answer.validity);
  for (int k = 0; k < 3; ++k) out.value[k] = answer.value[k];
  out.flags = answer.flags.bits();
  out.source = static_cast<std::int32_t>(answer.source);
  return write_sized(out, "lw_plane_light_answer", to);
}

/// `work(light, point, normal)` returns a PlaneLightAnswer.
template <class Work>
lw_status light_query(const lw_plane_light* light, const double* point, const double* normal,
                      lw_plane_light_answer* out, const Work& work) {
  const lw_status status = with_handle(light, [&](const PlaneLight& l) -> Status {
    if (point == nullptr) return null_argument("point");
    if (normal == nullptr) return null_argument("normal");
    Result<PlaneLightAnswer> answer = work(l, vector_at(point), vector_at(normal));
    return answer.ok() ? write_light(*answer, out) : answer.status();
  });
  return write_failure(status, "lw_plane_light_answer", out);
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_plane_reflector_create(const lw_reflection_options* options, lw_plane_reflector** out) {
  return call([&]() -> Status {
    if (out == nullptr) return invalid("out is NULL; pass the address of a pointer for the reflector");
    lw_reflection_options given{};
    if (options != nullptr)
      if (Status s = read_sized(options, "lw_reflection_options", given); !s.ok()) return s;
    ReflectionOptions parsed;
    if (given.cell != 0) parsed.cell = given.cell;
    if (given.tolerance != 0) parsed.tolerance = given.tolerance;
    Result<PlaneReflector> made = PlaneReflector::make(parsed);
    if (!made.ok()) return made.status();
    *out = std::make_unique<lw_plane_reflector>(std::move(*made)).release();
    return {};
  });
}

void lw_plane_reflector_release(lw_plane_reflector* reflector) {
  if (good(reflector)) delete reflector;
}

lw_status lw_plane_reflector_render(lw_plane_reflector* reflector, const lw_plane* plane, const lw_plane_grid* grid,
                                    const lw_radiant_mesh* object, const double* eye, float* reflected,
                                    size_t reflected_capacity, float* hidden, size_t hidden_capacity,
                                    lw_plane_reflection* about) {
  const lw_status status = with_handle(plane, [&](const PlaneAppearance& p) -> Status {
    if (!good(reflector)) return invalid(lw_plane_reflector::kRefusal);
    if (eye == nullptr) return null_argument("eye");
    PlaneGrid to;
    if (Status s = grid_of(grid, to); !s.ok()) return s;
    RadiantMesh from;
    if (Status s = radiant_mesh_of(object, reflector->value.positions, from); !s.ok()) return s;
    std::uint32_t size = 0;
    if (about != nullptr)
      if (Status s = size_of(about, "lw_plane_reflection", size); !s.ok()) return s;
    const std::size_t texels = static_cast<std::size_t>(to.columns) * static_cast<std::size_t>(to.rows);
    if (reflected == nullptr || reflected_capacity < 3 * texels)
      return invalid("the reflected radiance needs room for " + std::to_string(3 * texels) + " numbers");
    if (hidden == nullptr || hidden_capacity < texels)
      return invalid("the hidden shares need room for " + std::to_string(texels) + " numbers");
    const auto made = reflector->value.reflector.render(
        p, to, from, vector_at(eye), std::span(reinterpret_cast<Radiance*>(reflected), texels), {hidden, texels});
    if (!made.ok()) return made.status();
    return about == nullptr ? Status() : write_sized(as_c(*made), "lw_plane_reflection", about);
  });
  return write_failure(status, "lw_plane_reflection", about);
}

lw_status lw_plane_light_create(lw_plane_light** out) { return create(out); }

void lw_plane_light_release(lw_plane_light* light) {
  if (good(light)) delete light;
}

lw_status lw_plane_light_update(lw_plane_light* light, const lw_plane* plane) {
  return with_handle(light, [&](PlaneLight& l) -> Status {
    if (!good(plane)) return invalid(lw_plane::kRefusal);
    l.update(plane->value);
    return {};
  });
}

lw_status lw_plane_light_irradiance(const lw_plane_light* light, const double* point, const double* normal,
                                    lw_plane_layers layers, lw_plane_light_answer* out) {
  return light_query(light, point, normal, out,
                     [&](const PlaneLight& l, Vec3d at, Vec3d facing) -> Result<PlaneLightAnswer> {
                       PlaneLayers wanted{};
                       if (Status s = layers_of(layers, wanted); !s.ok()) return s;
                       return l.irradiance(at, facing, wanted);
                     });
}

lw_status lw_plane_light_irradiance_in(const lw_plane_light* light, const double* point, const double* normal,
                                       const lw_lighting* lighting, lw_plane_light_answer* out) {
  return light_query(light, point, normal, out,
                     [&](const PlaneLight& l, Vec3d at, Vec3d facing) -> Result<PlaneLightAnswer> {
                       if (!good(lighting)) return invalid(lw_lighting::kRefusal);
                       return l.irradiance(at, facing, lighting->value);
                     });
}

}  // extern "C"
