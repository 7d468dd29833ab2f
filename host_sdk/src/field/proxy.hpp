// Proxy geometry: triangles that hide lights and carry the radiance of what surrounds the probes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/field.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell::rays {
class RayScene;
}

namespace lightwell::field {

/// Immutable. Its surface is divided into texels of about kTexel_m, at most kMaxTexels.
class Proxy {
 public:
  static constexpr double kTexel_m = 0.25;
  static constexpr std::size_t kMaxTexels = 16'384;

  /// failed_precondition in a build without Embree.
  [[nodiscard]] static Result<std::shared_ptr<const Proxy>> make(const FieldGeometry& geometry);

  /// Whether something is between two points, not counting `margin_m` at both ends.
  [[nodiscard]] bool occluded(Vec3d from, Vec3d to, double margin_m) const;

  /// The unit normal, towards `from`, of the surface that a ray from there hits within `reach_m` of `at`; nullopt if it
  /// hits none there.
  [[nodiscard]] std::optional<Vec3d> surface_at(Vec3d at, Vec3d from, double reach_m) const;

  static constexpr std::uint32_t kNoTexel = 0xFFFFFFFF;
  /// The texels that rays from `origin` hit first; kNoTexel where one hits nothing. A multiple of 16 directions.
  void first_texels(Vec3d origin, std::span<const Vec3f> directions, std::span<std::uint32_t> out) const;

  /// A point of each texel.
  [[nodiscard]] std::span<const Vec3d> texels() const { return texels_; }

 private:
  struct Triangle {
    std::uint32_t first = 0, edge = 0;  ///< Its texels: edge x edge, in barycentric coordinates.
  };
  Proxy() = default;

  std::shared_ptr<const rays::RayScene> rays_;
  std::vector<Triangle> triangles_;
  std::vector<Vec3d> texels_;
};

}  // namespace lightwell::field
