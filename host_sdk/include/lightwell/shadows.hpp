// Soft shadows of a virtual object on a real plane: for each texel of the plane, the fraction of its light that
// remains.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

struct LightRatioTag {};
/// Diffuse irradiance with the object divided by that without it, per channel, 0 (no light remains) to 1. Multiply the
/// linear radiance of the real surface by it.
using LightRatio = Rgb<LightRatioTag>;

/// A rectangle of a real plane. Its frame: origin in the middle, +Z the normal of the lit side, +X right, +Y up.
struct ShadowReceiver {
  Pose T_lighting_plane;  ///< In the lighting's frame; T_world_plane for a lighting of in_world().
  double width_m = 0;     ///< Along X.
  double height_m = 0;    ///< Along Y.
  int columns = 256;      ///< Texels along X, 1 to kMaxSide. Column 0 is on the side of -X.
  int rows = 256;         ///< Texels along Y, 1 to kMaxSide. Row 0 is at the top, on the side of +Y.

  static constexpr int kMaxSide = 4096;

  /// invalid_argument for a pose that is not finite or without rotation, a size that is not above 0, or texels out of
  /// range.
  [[nodiscard]] Status validate() const;
};

/// A virtual object. The spans are borrowed for the duration of a call.
struct ShadowMesh {
  std::span<const Vec3f> positions;        ///< Vertices, m, in the mesh's frame.
  std::span<const std::uint32_t> indices;  ///< Three for each triangle, all with the same winding (either one).
  /// Identity: positions are in the plane's frame. inverse(T_lighting_plane): in the lighting's frame.
  Pose T_plane_mesh;
};

/// The trade of time for accuracy. Figures: host_sdk/README.md.
struct ShadowOptions {
  /// Most directions sampled of one light, 1 to 1024. A light whose penumbra is narrow gets fewer. Time grows
  /// proportionally, the error of wide penumbrae falls.
  int light_samples = 40;
  /// Directions sampled of the residual radiance, 1 to 1024. Time grows proportionally.
  int residual_directions = 96;
  /// Texels along the side of one cell in which the residual's occlusion is computed; interpolated between the cells. 1
  /// to 16. Time falls slowly; the shadow around contacts becomes blurred.
  int residual_cell = 1;

  [[nodiscard]] Status validate() const;
};

/// What a texture was computed from.
struct ShadowSummary {
  /// Triangles left out because a vertex is NaN or infinite, or farther than 2^20 texels from the plane's corner.
  std::size_t ignored_triangles = 0;
  int lights = 0;        ///< Lights that reach the plane: those above its horizon, with irradiance.
  int directions = 0;    ///< Directions sampled, of lights and residual.
  bool no_light = true;  ///< No light at all reaches the plane: every ratio is 1.
};

/// Computes shadow textures. Create it once and reuse it: it keeps its memory, so that a call allocates nothing if
/// receiver and mesh are not larger than before, and after a call with as many lights, near ones and residual included.
/// One thread.
///
/// Triangles are neighbours at an edge whose vertices they share, or have at the same positions. A call looks for
/// neighbours again if indices changed or vertices that coincided have parted; not if others have come together.
///
/// Method. The shadow that a direction of light casts is the parallel projection of the triangles onto the plane (from
/// a point of a near light: their perspective projection). The winding number of the projected silhouette, the edges
/// between triangles that face the light and others (Crow 1977, "Shadow Algorithms for Computer Graphics"), counts the
/// triangles above a point; it is accumulated with exact areas, so that a texel's value is the mean over its area. Each
/// light is sampled over its cap, clipped at the plane's horizon and weighted by the cosine; the residual,
/// Lighting::radiance(direction, 0), over the hemisphere (Jachnik, Newcombe & Davison 2012, section 6, samples a
/// captured hemisphere on a GPU).
class ShadowCaster {
 public:
  /// invalid_argument as ShadowOptions::validate().
  [[nodiscard]] static Result<ShadowCaster> make(const ShadowOptions& options = {});
  ShadowCaster(ShadowCaster&&) noexcept;
  ShadowCaster& operator=(ShadowCaster&&) noexcept;
  ~ShadowCaster();

  /// Fills ratios[row * columns + column]; every value is in 0..1. Where no light reaches the plane, in a channel or at
  /// all, or where a float cannot hold the irradiance, the ratio is 1. What lies below the plane casts no shadow. A
  /// near light (Lighting::position()) casts from its position, falls off with the squared distance, and illuminates
  /// what is above it not at all. validity, age, error_bound and flags are the lighting's; without light (validity
  /// none, before_history, invalid_query) all ratios are 1. Degenerate triangles cast nothing. invalid_argument, and
  /// nothing written, for a receiver as ShadowReceiver::validate(), a pose of the mesh that is not finite, indices out
  /// of range or not three for each triangle, and a span of another size than rows * columns.
  [[nodiscard]] Result<Answer<ShadowSummary>> cast(const Lighting& lighting, const ShadowReceiver& receiver,
                                                   const ShadowMesh& mesh, std::span<LightRatio> ratios);

 private:
  class Impl;
  explicit ShadowCaster(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
