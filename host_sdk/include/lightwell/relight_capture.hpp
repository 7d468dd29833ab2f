// Normals, albedo and refined depth of a subject from its photographs under basis lights (optional library
// lightwell_relight).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

struct PhotometricStereoOptions {
  /// How often the simulated indirect light is subtracted from the photographs and the surface estimated again, 0 to 8
  /// (shape from interreflections, Nayar, Ikeuchi & Kanade 1991). Without it concave parts are too bright and too flat.
  /// Each costs the simulation of all basis lights.
  int interreflection_rounds = 1;
  IndirectOptions indirect{.samples = 32};

  [[nodiscard]] Status validate() const;
};

struct PhotometricSurface {
  std::vector<Vec3f> normals;  ///< Unit, world; zero where there is no answer.
  std::vector<Albedo> albedo;  ///< 0 to 1; black where there is no answer.
  /// Pixels without geometry, and those that no light reaches.
  std::size_t without_answer = 0;
};

/// Photometric stereo (Woodham 1980) under near or distant lights: for each pixel the Lambertian surface that explains
/// its photographs. Lights that the geometry hides take no part. Of the surfaces through three bright photographs and
/// that of the geometry the one with the least truncated residuals is refined by least squares whose weights fall with
/// the residual (Cauchy), so that other shadows and highlights count little; a normal more than 60 degrees off that of
/// the geometry is replaced by it. The albedo is that of the photographs' unit (BasisLight::irradiance).
/// invalid_argument for pictures of other number or size and for lights that do not validate.
[[nodiscard]] Result<PhotometricSurface> estimate_surface(const RelightSubject& subject,
                                                          std::span<const BasisLight> basis, BasisPictures photographs,
                                                          const PhotometricStereoOptions& options = {});

struct DepthRefinementOptions {
  /// Weight of the measured depth against the normals, above 0 to 1: larger where depth is precise.
  double depth_weight = 0.1;
  /// Normals and depth are compared over squares of this half width, px, 1 to 256: there the normals take the mean of
  /// the depth's, since photometric normals are biased at low frequencies.
  int smoothing_px = 8;

  [[nodiscard]] Status validate() const;
};

/// Depth with the detail of the normals and the low frequencies of the measured depth (Nehab, Rusinkiewicz, Davis &
/// Ramamoorthi 2005, "Efficiently Combining Positions and Normals for Precise 3D Geometry", equations 5 to 9), by
/// linear least squares over the subject's pixels. 0 where there is no geometry. `normals`: world, zero where none is
/// known; invalid_argument for another number of them.
[[nodiscard]] Result<std::vector<float>> refine_depth(const RelightSubject& subject, std::span<const Vec3f> normals,
                                                      const DepthRefinementOptions& options = {});

}  // namespace lightwell
