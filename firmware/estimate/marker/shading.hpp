// Measured shading of a marker's faces and of the ground plane (the table) around it.
// Frame: the probe's axes, origin in the body's centre. Metres.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <lightwell/geometry.hpp>

namespace lightwell::marker {

/// r, g, b, linear.
using Rgb = std::array<double, 3>;

/// Rec. 709 luminance.
[[nodiscard]] inline double luminance(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

/// A patch of a face: its albedo is known, so its radiance gives irradiance.
struct SurfaceSample {
  Vec3d position;
  Vec3d normal;       ///< Unit, outwards.
  Rgb irradiance;     ///< pi * radiance / albedo.
  Rgb sigma;          ///< Standard deviation of the error of this sample alone: sensor noise, texture of the paper.
  int surface = 0;    ///< Samples of one surface share an error, too: attitude, paper, interreflection.
  Rgb from_ground{};  ///< Part of the irradiance that the ground plane reflects, if there is one.
};

/// A patch of the ground plane: its albedo is unknown, so only radiance is known.
struct GroundSample {
  Vec3d position;
  Rgb color{};
  double radiance = 0;  ///< Mean of the channels.
  double sigma = 0;
  /// Share of the ambient irradiance that the body occludes there, 0 to 1.
  double occluded = 0;
};

/// The plane on which the body stands.
struct GroundPlane {
  Vec3d point;
  Vec3d normal;       ///< Unit, towards the body.
  double step_m = 0;  ///< Between neighbouring samples.
  std::vector<GroundSample> samples;
};

struct Shading {
  std::vector<SurfaceSample> samples;
  std::optional<GroundPlane> ground;
  /// Points whose convex hull is the body.
  std::vector<Vec3d> hull;
  int channels = 3;  ///< 1: r, g and b are equal in every sample (a grey camera, or grey light).
};

/// Sets SurfaceSample::from_ground: the irradiance by the patches of the ground plane (the table), computed from its
/// radiance in the image. Both kinds of samples must be in the same units. Patches that the body or the image's edge
/// hides get the mean radiance of the visible ones at the same distance from the body.
void estimate_ground_reflection(Shading& shading);

/// Subtracts from_ground from the faces' irradiance, at most down to 0, and adds a fifth of it to the samples' sigma in
/// quadrature. For the hypothesis that the surroundings are a ground plane.
void subtract_ground_reflection(Shading& shading);

/// Removes samples of a face that another object or its shadow covers: outliers per flat face. Returns their number.
/// Irradiance along a face is approximately linear: the plane through three samples with the smallest median absolute
/// residual is the fit (Rousseeuw 1984, "Least median of squares regression"). Faces with fewer than six samples are
/// unchanged.
int remove_occluded_samples(Shading& shading);

}  // namespace lightwell::marker
