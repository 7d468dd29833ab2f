// The handle of a captured plane.
#pragma once

#include <string>

#include <lightwell/plane_appearance.h>
#include <lightwell/plane_appearance.hpp>

#include "c/call.hpp"

struct lw_plane {
  static constexpr std::uint64_t kKind = 0x656e616c705f776cU;  // "lw_plane"
  static constexpr const char* kRefusal = "this is not an lw_plane of lw_plane_create";

  lightwell::c::HandleTag tag{kKind};
  lightwell::PlaneAppearance value;
};

namespace lightwell::c {

inline Vec3d vector_at(const double* from) { return {from[0], from[1], from[2]}; }

inline Status layers_of(lw_plane_layers given, PlaneLayers& out) {
  if (given < LW_PLANE_ALL || given > LW_PLANE_SPECULAR)
    return invalid("layers is " + std::to_string(given) + "; it is LW_PLANE_ALL, _DIFFUSE or _SPECULAR");
  out = static_cast<PlaneLayers>(given);
  return {};
}

}  // namespace lightwell::c
