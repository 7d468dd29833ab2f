// Rays against triangles.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell::relight {

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
  /// Whether something is between `origin` and `distance` lengths of `direction`.
  [[nodiscard]] bool occluded(Vec3f origin, Vec3f direction, float distance) const;

 private:
  struct Scene;
  RayScene();
  std::unique_ptr<Scene> scene_;
};

}  // namespace lightwell::relight
