// Rays against a mesh with smooth normals, by Embree; the points that they hit in double.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "reference/vector.hpp"

namespace lightwell::reference {

struct SmoothMesh {
  std::vector<V3> positions, normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Any number of threads. Refers to the mesh.
class MeshRays {
 public:
  explicit MeshRays(const SmoothMesh& mesh);
  ~MeshRays();
  MeshRays(const MeshRays&) = delete;
  MeshRays& operator=(const MeshRays&) = delete;

  struct Hit {
    V3 at;
    V3 facet, normal;  ///< Of the triangle, against the ray; interpolated, on the same side.
    std::uint32_t triangle = 0;
  };
  /// `towards` is a unit vector.
  [[nodiscard]] std::optional<Hit> first_hit(const V3& from, const V3& towards) const;
  [[nodiscard]] bool occluded(const V3& from, const V3& towards,
                              double distance = std::numeric_limits<double>::infinity()) const;

 private:
  struct Scene;
  const SmoothMesh& mesh_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace lightwell::reference
