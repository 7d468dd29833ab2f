#include "core/mesh_arguments.hpp"

#include <algorithm>
#include <cstdint>

#include "core/mesh_topology.hpp"

namespace lightwell::core {
Status check_range(const char* name, int value, int least, int most) {
  if (value >= least && value <= most) return {};
  return invalid_argument(std::string(name) + " is " + std::to_string(value) + "; allowed are " +
                          std::to_string(least) + " to " + std::to_string(most));
}

Status check_mesh(const ShadowMesh& mesh) {
  if (!is_usable(mesh.T_plane_mesh))
    return invalid_argument("ShadowMesh::T_plane_mesh is not finite, or its rotation is zero");
  if (mesh.indices.size() % 3 != 0)
    return invalid_argument(std::to_string(mesh.indices.size()) + " indices are not three for each triangle");
  if (mesh.positions.size() >= kNoTriangle || mesh.indices.size() / 3 >= kNoTriangle)
    return invalid_argument("the mesh has more vertices or triangles than a 32-bit index can number");
  std::uint32_t largest = 0;
  for (const std::uint32_t i : mesh.indices) largest = std::max(largest, i);
  if (!mesh.indices.empty() && largest >= mesh.positions.size())
    return invalid_argument("the index " + std::to_string(largest) + " is out of range: there are " +
                            std::to_string(mesh.positions.size()) + " positions");
  return {};
}

Status check_texels(const char* what, std::size_t elements, int columns, int rows) {
  const std::size_t texels = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  if (elements == texels) return {};
  return invalid_argument(std::string("the span of ") + what + " has " + std::to_string(elements) +
                          " texels; there are " + std::to_string(texels));
}

}  // namespace lightwell::core
