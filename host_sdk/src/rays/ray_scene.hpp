// Rays against triangles, by Embree. For the optional libraries that need geometry: field and relight.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell::rays {

/// Immutable; any number of threads.
class RayScene {
 public:
  /// Takes a copy. Indices must be in range. resource_exhausted without memory.
  [[nodiscard]] static Result<std::shared_ptr<const RayScene>> make(std::span<const Vec3f> vertices,
                                                                    std::span<const std::uint32_t> indices);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  struct Hit {
    float distance = 0;  ///< In lengths of `direction`.
    Vec3f normal;        ///< Unit, against the ray.
  };
  [[nodiscard]] std::optional<Hit> first_hit(Vec3f origin, Vec3f direction) const;
  /// As many rays at once as processors have lanes.
  static constexpr std::size_t kLanes = 16;
  static constexpr std::uint32_t kNoTriangle = 0xFFFFFFFF;
  struct Hits {
    std::array<std::uint32_t, kLanes> triangle{};  ///< kNoTriangle: the ray hits nothing.
    std::array<float, kLanes> u{}, v{};            ///< Barycentric: of the triangle's second and third vertex.
  };
  /// What rays from `origin` hit first, 0.1 mm away or farther.
  void first_hits(Vec3f origin, std::span<const Vec3f, kLanes> directions, Hits& out) const;
  /// Whether something is between `origin` and `distance` lengths of `direction`.
  [[nodiscard]] bool occluded(Vec3f origin, Vec3f direction, float distance) const;

 private:
  struct Scene;
  RayScene();
  std::unique_ptr<Scene> scene_;
};

}  // namespace lightwell::rays
