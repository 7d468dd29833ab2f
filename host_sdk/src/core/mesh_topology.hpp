// The edges of a triangle mesh and the triangles at each: what stays while a mesh only moves or deforms.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

namespace lightwell::core {

/// An edge, oriented as in triangle `left`. `right` has it in the opposite direction; kNoTriangle at a border, and
/// where the neighbour has another winding or more than two triangles meet.
struct MeshEdge {
  std::uint32_t from = 0, to = 0;  ///< Vertices.
  std::uint32_t left = 0, right = 0;
};

inline constexpr std::uint32_t kNoTriangle = 0xffffffff;

class MeshTopology {
 public:
  /// Rebuilds the edges if `indices` changed, or if vertices that coincided at the last build no longer do. Otherwise
  /// takes microseconds. Indices must be in range. Allocates only if the mesh is larger than any before.
  void update(std::span<const Vec3f> positions, std::span<const std::uint32_t> indices);

  /// Triangles with three different vertices. Of vertices that coincide, all triangles have the first.
  [[nodiscard]] std::span<const std::array<std::uint32_t, 3>> triangles() const { return triangles_; }
  [[nodiscard]] std::span<const MeshEdge> edges() const { return edges_; }
  /// Whether each edge has two triangles.
  [[nodiscard]] bool closed() const { return closed_; }

 private:
  struct HalfEdge {
    std::uint64_t key = 0;  ///< The two vertices, the smaller one in the upper half.
    std::uint32_t triangle = 0;
    std::uint32_t descending = 0;  ///< 1: from the larger vertex to the smaller one.
  };

  [[nodiscard]] bool current(std::span<const Vec3f> positions, std::span<const std::uint32_t> indices) const;
  void weld(std::span<const Vec3f> positions);
  void pair_edges();

  std::vector<std::uint32_t> indices_;  ///< Of the last build.
  std::vector<std::uint32_t> first_;    ///< For each vertex, the first one at the same position.
  std::vector<std::uint32_t> hash_slots_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<HalfEdge> half_edges_;
  std::vector<MeshEdge> edges_;
  bool closed_ = true;
};

}  // namespace lightwell::core
