// A mesh above a receiver plane, ready to be projected from many points of light: silhouettes of all of them at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

#include "core/mesh_topology.hpp"

namespace lightwell::core {

/// Homogeneous point of light in texel space: w = 0 for the direction (x, y, z) towards a distant light, w = 1 for a
/// position. Texel space: x along columns, y along rows (downwards), z above the plane, all in widths of a texel's
/// column; the plane is z = 0. z > 0.
struct LightPoint {
  float x = 0, y = 0, z = 0, w = 0;
};

/// Two points in texel space.
struct Segment {
  Vec3f a, b;
};

/// Points of light whose silhouettes are found together: one bit each.
inline constexpr std::size_t kMaxBatch = 32;

/// An edge in the silhouette of some points of a batch.
struct SilhouetteEdge {
  std::uint32_t segment = 0;
  std::uint32_t changes = 0;  ///< Points from which one side faces the light and the other does not; all at a border.
  std::uint32_t facing = 0;   ///< Points that the left triangle faces.
  bool border = false;        ///< There is no right triangle.
};

/// The part of a mesh between the plane and a ceiling.
class Occluder {
 public:
  /// Vertices beyond this, in texels, are ignored with their triangles: floats could not resolve a texel there.
  static constexpr float kMaxCoordinate = 1 << 20;

  /// `vertices`: of the topology, in texel space. Allocates only if the mesh is larger than any before.
  void build(const MeshTopology& topology, std::span<const Vec3f> vertices, float ceiling);

  [[nodiscard]] std::size_t ignored_triangles() const { return ignored_; }
  /// Height of the highest vertex, at most the ceiling; 0 if nothing is above the plane.
  [[nodiscard]] float top() const { return top_; }
  /// Centre of the bounding box of what is above the plane.
  [[nodiscard]] Vec3f centre() const { return centre_; }
  /// Whether triangles that face the light cover all that the mesh covers: it is closed and does not cross the plane.
  [[nodiscard]] bool closed() const { return closed_; }

  [[nodiscard]] const Segment& segment(const SilhouetteEdge& edge) const { return segments_[edge.segment]; }

  /// The edges that are in a silhouette seen from at least one point; at most kMaxBatch points. Valid until the next
  /// call.
  [[nodiscard]] std::span<const SilhouetteEdge> silhouettes(std::span<const LightPoint> points);

 private:
  struct Sides {
    std::uint32_t left = 0, right = 0;
  };

  enum class Place : std::uint8_t { absent, inside, crossing };

  void place_triangles(const MeshTopology& topology, std::span<const Vec3f> vertices, float ceiling);
  void add_cuts(std::span<const std::array<std::uint32_t, 3>> triangles, std::span<const Vec3f> vertices, float height);
  void compute_facing(std::span<const LightPoint> points);

  std::vector<Place> places_;  ///< Of each triangle.
  /// Planes n.p + d of the triangles, zero where absent; padded to whole blocks.
  std::vector<float> normal_x_, normal_y_, normal_z_, offset_;
  std::vector<std::uint32_t> facing_;  ///< Of each triangle, a bit for each point of the batch.
  std::vector<Segment> segments_;
  std::vector<Sides> sides_;
  std::vector<SilhouetteEdge> silhouettes_;
  std::size_t ignored_ = 0;
  float top_ = 0;
  Vec3f centre_;
  bool closed_ = true;
};

}  // namespace lightwell::core
