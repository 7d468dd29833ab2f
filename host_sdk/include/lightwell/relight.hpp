// Relighting of a performance: photographs of a subject under basis lights become its picture under projected patterns
// and distant light, with the indirect light that these cause (optional library lightwell_relight).
//
// Method and equation numbers: Jones, Gardner, Bolas, McDowall & Debevec 2006, "Simulating Spatially Varying Lighting
// on a Live Performance". Pictures are linear, rows from the top, picture[row * columns + column].
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

struct FactorTag {};
/// Three factors without unit: a transmittance, a weight of a basis light, alpha.
using RgbFactor = Rgb<FactorTag>;

/// A pinhole camera without distortion. Camera frame: right-handed, +Y up, -Z forward. The centre of pixel (column,
/// row) is seen along ((column + 0.5 - centre_x_px) / focal_px, -(row + 0.5 - centre_y_px) / focal_px, -1).
struct RelightCamera {
  int columns = 0, rows = 0;  ///< 1 to kMaxSide.
  double focal_px = 0;        ///< Above 0.
  double centre_x_px = 0, centre_y_px = 0;
  Pose T_world_camera;

  static constexpr int kMaxSide = 4096;

  [[nodiscard]] std::size_t pixels() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  /// invalid_argument, naming the member and the value.
  [[nodiscard]] Status validate() const;
};

enum class LightDistance : std::uint8_t { finite, distant };

/// One of the lights under which the subject was photographed, alone.
struct BasisLight {
  Vec3d place;  ///< World: position in m; of a distant light the direction towards it, any length above 0.
  LightDistance distance = LightDistance::finite;
  /// At normal incidence: 1 m from a near light, which falls with the squared distance; anywhere from a distant one. In
  /// the unit of the photographs: a white matte surface shows this / pi.
  Irradiance irradiance{1, 1, 1};
};

/// A projector with a picture in front of it: a slide, a gobo, window blinds, stained glass. Even in all directions of
/// the picture, black outside of it.
struct PatternLight {
  Pose T_world_light;                  ///< It shines along -Z, +Y is up in the picture.
  double field_of_view_rad = 0;        ///< Across the picture's columns, above 0, below pi. Texels are square.
  int columns = 0, rows = 0;           ///< 1 to 4096.
  std::span<const RgbFactor> picture;  ///< Transmittance, at least 0. Valid during the call that takes it.
  Irradiance irradiance{1, 1, 1};      ///< At normal incidence, 1 m away, where the transmittance is 1.
};

/// Triangles, world, m. Their orientation does not matter.
struct RelightMesh {
  std::span<const Vec3f> vertices;
  std::span<const std::uint32_t> indices;  ///< Three a triangle.

  static constexpr std::size_t kMaxTriangles = std::size_t{1} << 24;
};

namespace relight {
struct SubjectData;
struct AlphaData;
}  // namespace relight

/// What is known of each pixel.
struct SubjectPixels {
  std::span<const Albedo> albedo;  ///< 0 to 1 (larger is taken as 1), one a pixel. Empty: black, no indirect light.
  std::span<const Vec3f> normals;  ///< World, any length; zero, or an empty span: the normal of the geometry.
};

/// Geometry and reflectance of the subject in one frame. Immutable; copies share their memory, threads may use it
/// concurrently.
class RelightSubject {
 public:
  /// The surface that the camera sees, from the depth along its axis, m. A depth that is 0, negative or not finite: no
  /// geometry there. Neighbouring pixels are one surface unless that would be steeper than kMaxSlope.
  /// invalid_argument for spans of other sizes and values of albedo and normals that are not finite.
  [[nodiscard]] static Result<RelightSubject> from_depth(const RelightCamera& camera, std::span<const float> depth_m,
                                                         const SubjectPixels& pixels);
  /// A whole mesh; the depth of each pixel is found by a ray. What the camera does not see has the mean albedo.
  /// invalid_argument as above and for indices out of range, resource_exhausted beyond kMaxTriangles.
  [[nodiscard]] static Result<RelightSubject> from_mesh(const RelightCamera& camera, const RelightMesh& mesh,
                                                        const SubjectPixels& pixels);
  /// Tangent of the angle to the picture's plane, 80 degrees.
  static constexpr double kMaxSlope = 6;
  /// The same geometry with other albedo and normals. invalid_argument as from_depth().
  [[nodiscard]] Result<RelightSubject> with(const SubjectPixels& pixels) const;

  [[nodiscard]] const RelightCamera& camera() const;
  /// Depth of each pixel along the camera's axis, m; 0 where there is no geometry.
  [[nodiscard]] std::span<const float> depth_m() const;
  /// Unit, world; zero where there is no geometry.
  [[nodiscard]] std::span<const Vec3f> normals() const;
  [[nodiscard]] std::size_t pixels_without_geometry() const;

  /// Used by the library.
  explicit RelightSubject(std::shared_ptr<const relight::SubjectData> data) : data_(std::move(data)) {}
  [[nodiscard]] const relight::SubjectData& data() const { return *data_; }

 private:
  std::shared_ptr<const relight::SubjectData> data_;
};

/// What alpha could not say.
struct AlphaSummary {
  /// Pixels without geometry. They have the constant weights alone: no pattern reaches them.
  std::size_t without_geometry = 0;
  /// Pixels that a pattern reaches and none of its basis lights does. They are shaded from albedo and normal.
  std::size_t modelled = 0;
  std::size_t limited = 0;  ///< Pixels whose alpha would exceed kMaxAlpha: a basis light without irradiance there.
  /// Largest angle between a pattern, seen from the subject, and the nearest basis light, rad.
  double widest_rad = 0;

  static constexpr float kMaxAlpha = 1e4F;
};

/// alpha of each basis light (equation 1): a constant, plus a map where a pattern uses the light. One thread. Computing
/// it again keeps the memory of the maps.
///
/// A pattern whose place is that of a basis light (within 0.1 % of the distance) uses this light alone: shadows are
/// those of the photograph. A pattern elsewhere is blended from the three basis lights around the ray that reaches it
/// (vector base amplitude panning, Pulkki 1997). It reaches what a ray of the geometry says; a basis light counts where
/// it reaches the pixel, and the sum is corrected by the ratio of Lambert's cosines.
class AlphaMaps {
 public:
  static constexpr std::size_t kMaxLights = 256, kMaxPatterns = 64;

  AlphaMaps();
  AlphaMaps(AlphaMaps&&) noexcept;
  AlphaMaps& operator=(AlphaMaps&&) noexcept;
  ~AlphaMaps();

  /// `weights`: constant factor of each basis light, at least 0, as basis_weights() gives for distant light; or empty.
  /// invalid_argument, naming light and member, for values that are negative or not finite.
  [[nodiscard]] Result<AlphaSummary> compute(const RelightSubject& subject, std::span<const BasisLight> basis,
                                             std::span<const PatternLight> patterns,
                                             std::span<const RgbFactor> weights);

  [[nodiscard]] std::size_t lights() const;
  /// alpha of a light at a pixel, without its constant weight; 0 for indices out of range.
  [[nodiscard]] RgbFactor at(std::size_t light, std::size_t pixel) const;
  /// Whether a pattern uses this light.
  [[nodiscard]] bool has_map(std::size_t light) const;

  /// Used by the library.
  [[nodiscard]] const relight::AlphaData& data() const { return *data_; }

 private:
  std::unique_ptr<relight::AlphaData> data_;
};

/// A photograph under each basis light, in their order.
using BasisPictures = std::span<const std::span<const Radiance>>;

/// Equation 1: out = sum of alpha times the photographs, which are taken as direct light alone. Never NaN: values of
/// photographs that are negative or not finite count as 0. invalid_argument for pictures of other number or size.
[[nodiscard]] Status relight_direct(const AlphaMaps& alpha, BasisPictures basis, std::span<Radiance> out);

/// How indirect light is simulated.
struct IndirectOptions {
  int samples = 64;  ///< Rays of a simulated pixel, 1 to 65,536. Time grows with it, noise falls with its root.
  int bounces = 3;   ///< 1 (as the paper) to 64. Rays are shared: two further bounces cost a tenth of the first one.
  int step = 2;      ///< Every step-th pixel in both directions is simulated, 1 to 16; others are upsampled.
  std::uint64_t seed = 1;  ///< The same seed gives the same picture.
  /// Reflectance of the surface of a dielectric, which albedo does not include, for light from all directions, 0 to 1:
  /// a share r of the light is reflected white before the rest meets the albedo, here in all directions alike. The
  /// default is that of refractive index 1.5 (Schlick 1994: r0 + (1 - r0) / 21, r0 = 0.04); 0 for surfaces that are
  /// matte.
  float surface_reflectance = 0.086F;

  [[nodiscard]] Status validate() const;
};

/// Simulated indirect light, as radiance of each pixel.
struct IndirectLight {
  /// I_existing of each basis light that has a map of alpha; empty for others, which need none (constant weights scale
  /// direct and indirect light alike).
  std::vector<std::vector<Radiance>> existing;
  std::vector<Radiance> spatial;     ///< I_spatial, of all patterns together.
  std::size_t simulated_pixels = 0;  ///< Pixels with rays of their own.
};

/// Simulates both indirect parts of equation 5 (section 4.3) from geometry and albedo, Lambertian: cosine-weighted rays
/// of Embree, whose hits take the radiosity of the pixel that shows them; pixels between simulated ones by joint
/// bilateral upsampling of irradiance (Kopf et al. 2007). `alpha` is that of the same subject and basis.
/// invalid_argument as AlphaMaps::compute(). One thread.
[[nodiscard]] Result<IndirectLight> simulate_indirect(const RelightSubject& subject, std::span<const BasisLight> basis,
                                                      std::span<const PatternLight> patterns, const AlphaMaps& alpha,
                                                      const IndirectOptions& options = {});

/// Equation 5: L_spatial = alpha (L_existing - I_existing) + I_spatial, summed over the basis; the difference is at
/// least 0. Otherwise as relight_direct().
[[nodiscard]] Status relight_corrected(const AlphaMaps& alpha, BasisPictures basis, const IndirectLight& indirect,
                                       std::span<Radiance> out);

/// Constant weights that reproduce distant light: each direction's light is divided among the basis lights around it.
/// `lighting` as the subject sees it at `at` (world, m): its lights, and its residual as `residual_directions` lights
/// (0 to 4096). A light of known distance is seen from `at`. failed_precondition for a lighting without values;
/// invalid_argument for a basis light without irradiance at `at`, or a pose or point that is not finite.
[[nodiscard]] Result<std::vector<RgbFactor>> basis_weights(const Lighting& lighting, const Pose& T_world_lighting,
                                                           std::span<const BasisLight> basis, Vec3d at,
                                                           int residual_directions = 512);
/// The same for an equirectangular panorama (equirect.hpp) of columns x rows pixels, in the world's axes.
[[nodiscard]] Result<std::vector<RgbFactor>> basis_weights(std::span<const Radiance> panorama, int columns, int rows,
                                                           std::span<const BasisLight> basis, Vec3d at);

/// Light at a place in the terms of AlphaMaps::compute().
struct PlaceLights {
  std::vector<PatternLight> patterns;  ///< White: lights of known distance, whose light varies over the subject.
  std::vector<RgbFactor> weights;      ///< Of all other light, as basis_weights().
  /// Indices in Lighting::lights() of lights of known distance that are in `weights` because they are nearer to the
  /// subject's centre than 1.2 times its radius, or beyond AlphaMaps::kMaxPatterns.
  std::vector<std::size_t> left_in_weights;
};

/// As basis_weights(), but a light of known distance becomes a pattern, so that its irradiance, direction and shadow
/// are those of each pixel's point: LightField::at() gives such lights, and a probe that knows their distance. The
/// subject's centre is the mean of its points, which is also `at` of basis_weights(); its radius is the largest
/// distance of a point from it. Lights beyond 100 radii stay weights: over the subject their irradiance differs by 2 %
/// from that at its centre. Irradiance holds at the lighting's origin: take a lighting of the subject's centre.
/// failed_precondition, invalid_argument as basis_weights(); invalid_argument for a subject without geometry.
[[nodiscard]] Result<PlaceLights> place_lights(const Lighting& lighting, const Pose& T_world_lighting,
                                               std::span<const BasisLight> basis, const RelightSubject& subject,
                                               int residual_directions = 512);

}  // namespace lightwell
