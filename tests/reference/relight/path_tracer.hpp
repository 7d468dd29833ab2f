// Path tracing of a mesh under lamps and projectors: rays by Embree, all else in double and of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "reference/image_object/mesh_rays.hpp"
#include "reference/relight/patterns.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// Lambert's diffuse reflection and a GGX coat of Fresnel reflectance f0 at normal incidence (0: none).
struct TracedMaterial {
  Rgb albedo{};
  double alpha = 0.5, f0 = 0;
};

/// Triangles with a normal at each vertex. The material is that of a triangle at a point.
struct TracedMesh : SmoothMesh {
  std::function<TracedMaterial(std::uint32_t triangle, const V3& at)> material;
};

/// The figurine of tests/reference/image_object: a wrinkled body, a bowl with a ball in it, a ring, a rippled plate.
[[nodiscard]] TracedMesh traced_figurine();

/// A point light, or a projector at a point that looks at `aim`, with +Y up.
struct TracedLight {
  V3 position;
  Rgb intensity{1, 1, 1};  ///< Irradiance at normal incidence, 1 m away.
  LightPattern pattern = LightPattern::none;
  V3 aim;
  double half_width_tan = 0.2;  ///< Tangent of half of the angle across its picture.
};

/// A pinhole camera at `eye` that looks along -Z, +Y up.
struct TracedCamera {
  int columns = 320, rows = 240;
  double focal_px = 0;
  V3 eye;
};

struct TraceOptions {
  int samples = 64;      ///< Of a pixel: the next larger square, stratified.
  int max_bounces = 16;  ///< Indirect ones; 0: direct light alone.
  std::uint32_t seed = 1;
  int threads = 1;
};

/// Pictures; [row * columns + column], rows from the top.
struct TracedPictures {
  std::vector<float> coverage;               ///< Share of the samples of a pixel that see the mesh.
  std::vector<float> depth;                  ///< Along the camera's axis, at the pixel's centre; 0: nothing.
  std::vector<std::array<float, 3>> albedo;  ///< Mean over the pixel.
  std::vector<std::array<float, 3>> normal;  ///< Mean of the shading normals over the pixel, unit.
  std::vector<std::vector<std::array<float, 3>>> light;   ///< Radiance under each light.
  std::vector<std::vector<std::array<float, 3>>> direct;  ///< The part that comes from the light directly.
};

class PathTracer {
 public:
  explicit PathTracer(TracedMesh mesh);
  ~PathTracer();
  PathTracer(const PathTracer&) = delete;
  PathTracer& operator=(const PathTracer&) = delete;

  /// Every light sees the same paths. Equal options give equal pictures, whatever the number of threads.
  [[nodiscard]] TracedPictures trace(const TracedCamera& camera, const std::vector<TracedLight>& lights,
                                     const TraceOptions& options) const;
  [[nodiscard]] const TracedMesh& mesh() const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace lightwell::reference
