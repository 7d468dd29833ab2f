// Meshes of the C ABI.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include <lightwell/shadows.h>
#include <lightwell/shadows.hpp>

#include "c/call.hpp"

namespace lightwell::c {

/// The mesh, with its positions copied from memory of any stride into `positions`.
inline Status mesh_of(const lw_shadow_mesh* given, std::vector<Vec3f>& positions, ShadowMesh& out) {
  lw_shadow_mesh mesh{};
  if (Status s = read_sized(given, "lw_shadow_mesh", mesh); !s.ok()) return s;
  std::size_t stride = 0;
  if (Status s = stride_of(mesh.position_stride, "lw_shadow_mesh.position_stride", stride); !s.ok()) return s;
  if (mesh.position_count > 0 && mesh.positions == nullptr)
    return invalid("lw_shadow_mesh.positions is NULL, and position_count is not 0");
  if (mesh.index_count > 0 && mesh.indices == nullptr)
    return invalid("lw_shadow_mesh.indices is NULL, and index_count is not 0");
  if (mesh.position_count > UINT32_MAX) return invalid("the mesh has more vertices than a 32-bit index can number");
  positions.resize(mesh.position_count);
  const auto* from = static_cast<const unsigned char*>(mesh.positions);
  for (std::size_t i = 0; i < positions.size(); ++i) std::memcpy(&positions[i], from + i * stride, sizeof(Vec3f));
  out = {positions, std::span(mesh.indices, mesh.index_count), pose_of(mesh.position, mesh.orientation)};
  return {};
}

}  // namespace lightwell::c
