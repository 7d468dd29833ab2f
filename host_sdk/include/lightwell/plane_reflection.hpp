// The reflection of a virtual object in a captured glossy plane, blurred by the plane's gloss lobe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <lightwell/captured_plane.hpp>
#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/plane_appearance.hpp>
#include <lightwell/result.hpp>
#include <lightwell/shadows.hpp>

namespace lightwell {

/// Texels of a rectangle in a plane, with sides along X and Y of the plane's frame (captured_plane.hpp).
struct PlaneGrid {
  PlanePoint centre;
  double width_m = 0;   ///< Along X, 1e-6 to 1e6.
  double height_m = 0;  ///< Along Y, 1e-6 to 1e6.
  int columns = 256;    ///< Texels along X, 1 to kMaxSide. Column 0 is on the side of -X.
  int rows = 256;       ///< Texels along Y, 1 to kMaxSide. Row 0 is at the top, on the side of +Y.

  static constexpr int kMaxSide = 1024;

  /// invalid_argument for a centre that is not finite, sizes or texels out of range, and texels more than 1000 times as
  /// long in one direction as in the other.
  [[nodiscard]] Status validate() const;
};

/// What the elements of RadiantMesh::radiance belong to.
enum class RadiancePer : std::uint8_t { vertex, triangle };

/// A virtual object with the radiance that leaves its surface, the same in all directions and on both sides. The spans
/// are borrowed for the duration of a call.
struct RadiantMesh {
  ShadowMesh mesh;  ///< As for ShadowCaster.
  /// Linear, in the unit of the plane's radiance: cd/m² by luminance if PlaneInfo::units are absolute. A value that is
  /// negative or NaN counts as 0, one above 1e30 as 1e30.
  std::span<const Radiance> radiance;
  /// One element for each of mesh.positions, interpolated between them, or for each triangle.
  RadiancePer per = RadiancePer::vertex;
};

/// The trade of time for accuracy. Figures: host_sdk/README.md.
struct ReflectionOptions {
  /// Largest size of a part of the object that is evaluated as one, relative to the width of the gloss lobe there; 0.1
  /// to 1. Smaller values take more time; measured times: host_sdk/README.md.
  double tolerance = 0.5;
  /// Texels along a cell within which a wide blur is interpolated; 1 to 16. Texels near a contact are computed singly.
  int cell = 4;

  [[nodiscard]] Status validate() const;
};

/// What render() computed.
struct PlaneReflection {
  /// The plane's validity (valid or stale), or one of the following. none: nothing was received, or the probe knows no
  /// gloss (a matte plane). invalid_query: the eye is not finite or not in front of the plane. For the last two all
  /// texels are 0.
  Validity validity = Validity::none;
  bool f0_assumed = false;  ///< The probe sends no f0: it is taken as 0.04.
  /// Triangles left out because a vertex is NaN or infinite, or farther than 2^20 texels from the grid's centre.
  std::size_t ignored_triangles = 0;
  std::size_t texels = 0;  ///< Texels with a hidden share above 0.001.
};

/// Renders what a glossy plane reflects of a virtual object towards one eye. Create it once and reuse it: it keeps its
/// memory, so that a call allocates nothing if grid, mesh and the reflected image are not larger than before. One
/// thread.
///
/// With the plane's diffuse radiance D and specular radiance S (PlaneAppearance), the radiance of a texel is
/// D + S (1 - hidden) + reflected; D times the ratio of ShadowCaster where the object shadows the plane.
///
/// Method. The object is rasterised as the mirrored eye sees it (planar reflection), with pixels of half a texel,
/// larger outside the grid. The visible pixels become surfels in a quadtree with vector area, mean radiance and
/// bounding radius. A texel sums f(v, l) n·l L dω over those nodes of the tree that are small against the lobe (the
/// hierarchical gathering of Christensen 2008, "Point-Based Approximate Color Bleeding"), with the BRDF of
/// specular_brdf.hpp widened to the size of a pixel. Where the lobe is narrower than a texel, next to a contact, the
/// texel shows the mirror image itself.
class PlaneReflector {
 public:
  /// invalid_argument as ReflectionOptions::validate().
  [[nodiscard]] static Result<PlaneReflector> make(const ReflectionOptions& options = {});
  PlaneReflector(PlaneReflector&&) noexcept;
  PlaneReflector& operator=(PlaneReflector&&) noexcept;
  ~PlaneReflector();

  /// For texel (row, column), at row * columns + column: the radiance from the object by way of the plane's gloss
  /// towards `eye` (m, plane's frame; above 0, never NaN), and the share of the gloss lobe that the object covers, 0
  /// to 1: of S, `hidden` is lost if the room is uniform over the lobe. Gloss and f0 are those of plane.info(). What is
  /// below the plane is not reflected, and an object that crosses it is taken as solid. What the mirrored eye does not
  /// see of the object, because other parts are before it, does not contribute. invalid_argument, and nothing written,
  /// for a grid as PlaneGrid::validate(), a pose of the mesh that is not finite, indices out of range or not three for
  /// each triangle, a radiance of another length than vertices or triangles, and spans of another size than rows *
  /// columns.
  [[nodiscard]] Result<PlaneReflection> render(const PlaneAppearance& plane, const PlaneGrid& grid,
                                               const RadiantMesh& object, Vec3d eye, std::span<Radiance> reflected,
                                               std::span<float> hidden);

 private:
  class Impl;
  explicit PlaneReflector(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
