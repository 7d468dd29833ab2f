// The subject of one frame: what each pixel shows, and rays against its geometry.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

#include "rays/ray_scene.hpp"

namespace lightwell::relight {

using rays::RayScene;

/// Whether triangles are all of the subject, or the side that the camera sees.
enum class SurfaceExtent : std::uint8_t { whole, seen_side };

/// Triangles; the scene of rays is built when a ray needs it first.
class SubjectSurface {
 public:
  SubjectSurface(std::vector<Vec3f> vertices, std::vector<std::uint32_t> indices, SurfaceExtent extent)
      : vertices_(std::move(vertices)), indices_(std::move(indices)), extent_(extent) {}
  [[nodiscard]] Result<std::shared_ptr<const RayScene>> rays() const;
  [[nodiscard]] SurfaceExtent extent() const { return extent_; }

 private:
  std::vector<Vec3f> vertices_;
  std::vector<std::uint32_t> indices_;
  SurfaceExtent extent_;
  mutable std::once_flag built_;
  mutable Status status_;
  mutable std::shared_ptr<const RayScene> rays_;
};

/// Where a point of space is seen.
struct Projection {
  std::size_t pixel = 0;
  float depth = 0;
};

/// A part of a pixel that shows several surfaces.
struct SubPixel {
  Vec3f position, normal;
  std::size_t like = 0;  ///< A pixel that shows the same surface.
};

/// A pixel that shows several surfaces, and its range of SubjectData::sub_pixels.
struct MixedPixel {
  std::size_t pixel = 0, first = 0, count = 0;
};

struct SubjectData {
  RelightCamera camera;
  std::vector<float> depth;      ///< 0: no geometry. Positions and normals are zero there.
  std::vector<Vec3f> positions;  ///< World.
  std::vector<Vec3f> facets;     ///< Normal of the geometry, towards the camera.
  std::vector<Vec3f> normals;    ///< For shading.
  std::vector<Albedo> albedo;
  Albedo mean_albedo;
  Vec3d centre;  ///< Of the positions.
  std::size_t without_geometry = 0;
  /// Of a mesh: the pixels beside a step of depth or on a steep surface, in their order, and what 4 x 4 rays see in
  /// each. None for a depth map.
  std::vector<MixedPixel> mixed;
  std::vector<SubPixel> sub_pixels;
  std::shared_ptr<const SubjectSurface> surface;

  [[nodiscard]] bool has_geometry(std::size_t pixel) const { return depth[pixel] > 0; }
  [[nodiscard]] bool same_surface(std::size_t a, std::size_t b) const;
  /// Width of a pixel at its depth, m.
  [[nodiscard]] float pixel_size(std::size_t pixel) const { return depth[pixel] / static_cast<float>(camera.focal_px); }
  /// Where rays that leave the surface start: in front of it, so that they do not meet it.
  [[nodiscard]] Vec3f ray_origin(std::size_t pixel) const {
    return positions[pixel] + facets[pixel] * (kRayOffset_px * pixel_size(pixel));
  }
  static constexpr float kRayOffset_px = 0.1F;
  /// nullopt outside of the picture and behind the camera.
  [[nodiscard]] std::optional<Projection> project(Vec3f world) const;
  /// Whether a point is on the surface that its pixel shows.
  [[nodiscard]] bool is_near(Vec3f world, const Projection& seen) const;
};

/// invalid_argument with the names if a number of values is not that of the pixels.
[[nodiscard]] Status check_size(const std::string& name, std::size_t size, std::size_t pixels);

}  // namespace lightwell::relight
