// A glossy textured plane under distant light: reflection, its table over viewing directions, pictures of a pinhole
// camera.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "reference/panorama.hpp"
#include "reference/rotation.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

// The plane's frame: right-handed, metres, origin at the plane's centre, +Z the normal, +X right and +Y up in the
// texture. In a panorama's world axes +X is world +X, +Y is world -Z, +Z is world +Y. The panorama is infinitely far.
// Directions v (to the eye) and l (to the light) are unit vectors away from the surface, in the plane's frame.

inline V3 plane_from_world(const V3& d) { return {d.x, -d.z, d.y}; }
inline V3 world_from_plane(const V3& d) { return {d.x, d.z, -d.y}; }

enum class FresnelTerm {
  kSchlick,     ///< f0 + (1 - f0)(1 - v.h)^5
  kOne,         ///< 1: what a perfect conductor reflects
  kDielectric,  ///< the exact term of unpolarised light for the index of refraction (Walter et al. 2007, eq. 22)
};

/// The glossy part of the plane's reflection.
struct Gloss {
  double alpha = 0.1;  ///< width of the GGX distribution, 0 < alpha <= 1: the square of the perceptual roughness
  FresnelTerm fresnel = FresnelTerm::kSchlick;
  double f0 = 0.04;    ///< for kSchlick
  double index = 1.5;  ///< for kDielectric
};

/// The Fresnel term at v.h.
double fresnel(const Gloss& gloss, double v_dot_h);

/// f_s = D(h) G2(v, l) F(v.h) / (4 n.v n.l) in 1/sr; 0 if v or l is not above the horizon. D: GGX, isotropic (Walter et
/// al. 2007, eq. 33; glTF 2.0, appendix B.3.2). G2: height-correlated Smith term of GGX (Heitz 2014, eq. 99), so that
/// G2 / (4 n.v n.l) = 1/2 / (n.l g(n.v) + n.v g(n.l)), g(c) = sqrt(alpha^2 + (1 - alpha^2) c^2).
double gloss_brdf(const Gloss& gloss, const V3& v_plane, const V3& l_plane);

/// S(v): the integral of f_s L n.l over the upper hemisphere. Every pixel of the panorama is divided into
/// samples_per_axis^2 cells, with f_s n.l at the middle of each. 0 for v not above the horizon.
///
/// Near the mirror direction the lobe has the width 2 alpha in elevation and 2 alpha tan(elevation of v) in azimuth:
/// the cells must be a third of that for an error of 1 % of a light as small as a pixel.
Rgb specular_radiance(const Panorama& env, const V3& v_plane, const Gloss& gloss, int samples_per_axis);

/// E: the integral of L n.l over the upper hemisphere, exact for uniform pixels.
Rgb plane_irradiance(const Panorama& env);

/// S(v) at directions of the upper hemisphere, interpolated by cubic polynomials. For elevations above 8 degrees the
/// error is below 0.3 % of the largest S; below 8 degrees the lobe becomes narrower than the table's step in azimuth.
///
/// The sum over the panorama is not cut off, because GGX has long tails: beyond k alpha of slope of the half vector
/// there remains 1 / (1 + k^2) of the lobe, so that 1e-3 would need k = 32. Instead, pixels far from the lobe are
/// joined to blocks, each with its power at its centroid; pixels near the lobe are divided.
class SpecularTable {
 public:
  SpecularTable(const Panorama& env, const Gloss& gloss);

  /// S(v); v_plane a unit vector. 0 for v not above the horizon.
  [[nodiscard]] Rgb radiance(const V3& v_plane) const;

  [[nodiscard]] std::size_t direction_count() const { return values_.size(); }

 private:
  struct Row {
    std::size_t start = 0;
    int count = 0;
  };
  [[nodiscard]] Rgb along_row(const Row& row, double turns) const;

  // Row i has the elevation (i + 1/2) / rows * 90 degrees; its entry k has the azimuth 2 pi k / count from +X to +Y.
  std::vector<Row> rows_;
  std::vector<Rgb> values_;
};

/// The albedo of a square plane, n x n texels, row-major, row 0 at the +Y edge, R G B a texel. Texel (i, j) has its
/// centre at x = ((i + 0.5) / n - 0.5) size, y = (0.5 - (j + 0.5) / n) size.
struct PlaneTexture {
  int n = 0;
  std::vector<double> rgb;
  bool nearest = false;  ///< false: bilinear between texel centres, constant beyond the outermost ones
};

/// The albedo at the point (x, y) of a plane of that size; points off the plane have the albedo of its edge.
Rgb albedo_at(const PlaneTexture& texture, double size_m, double x, double y);

/// Pixel (0, 0) is the CENTRE of the first pixel. Axes _cv: x right, y down, z forward.
struct PinholeCamera {
  int width = 0, height = 0;
  double focal_px = 1, cx = 0, cy = 0;
};

/// p_to = rotation p_from + translation; T_camera_plane maps points of the plane's frame to the camera's.
struct Pose {
  M3 rotation{V3{1, 0, 0}, V3{0, 1, 0}, V3{0, 0, 1}};
  V3 translation;
};

/// The camera's centre in the plane's frame.
V3 eye_of(const Pose& T_camera_plane);

/// What a picture shows. The table must outlive it.
struct GlossyScene {
  PlaneTexture albedo;
  double size_m = 0.2;
  Rgb irradiance{};
  const SpecularTable* specular = nullptr;  ///< null: a matte plane
  Rgb background{};                         ///< radiance of all that is not the plane, its back included
  /// Where the half x >= 0 is of another material: its table, null for a matte one.
  std::optional<const SpecularTable*> right_half{};
  /// A page that curls: the surface is z = x^2 curl / size, so that its slope at the edges is +-curl. Its mirror
  /// directions are those of the tilted normal; lobe and Fresnel's term are those of a flat plane that mirrors the same
  /// direction.
  double curl = 0;
  Rgb irradiance_by_slope{};  ///< change of the irradiance for a slope dz/dx of 1
};

/// Linear radiance, row-major, R G B a pixel.
struct GlossyView {
  int width = 0, height = 0;
  std::vector<double> rgb;
  std::vector<double> coverage;  ///< a pixel: the fraction of its samples that are on the plane
};

/// The radiance albedo / pi E + S(v) that leaves the plane's point (x, y) towards v.
Rgb radiance_towards(const GlossyScene& scene, double x, double y, const V3& v_plane);

/// A picture through a box filter of one pixel: samples_per_axis^2 samples of plane and albedo, and
/// specular_samples_per_axis^2 samples of S, which depends on the pixel's direction alone. With one sample of S the
/// error is about (w / alpha)^2 / 24 of the peak for a pixel that is w rad wide: 1e-4 for 600 px of focal length and
/// alpha 0.03.
GlossyView render_view(const GlossyScene& scene, const PinholeCamera& camera, const Pose& T_camera_plane,
                       int samples_per_axis = 3, int specular_samples_per_axis = 1);

}  // namespace lightwell::reference
