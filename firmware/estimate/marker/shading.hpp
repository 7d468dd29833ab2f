// Measured shading of a marker's faces and of the ground plane (the table) around it; the body's geometry at a pose;
// the light model: ambient light of SH bands 0 and 1, distant or near point lights, and its error model.
// Frame: the probe's axes, origin in the body's centre. Metres.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>

#include "calibration/model/camera_model.hpp"

namespace lightwell::marker {

/// r, g, b, linear.
using Rgb = std::array<double, 3>;

/// Rec. 709 luminance.
[[nodiscard]] inline double luminance(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

/// A patch of a face: its albedo is known, so its radiance gives irradiance.
struct SurfaceSample {
  Vec3d position;
  Vec3d normal;       ///< Unit, outwards.
  Rgb irradiance;     ///< pi * radiance / albedo, without the specular reflection (gloss.hpp).
  Rgb sigma;          ///< Standard deviation of this sample's own error: sensor noise, texture, specular reflection.
  int surface = 0;    ///< Samples of one surface share an error, too: attitude, paper, interreflection.
  Rgb from_ground{};  ///< Part of the irradiance that the ground plane reflects, if there is one.
  /// Radius of a sphere around the origin that hides lights from the sample, m: the ball, for a patch of its sheet. 0:
  /// nothing hides them.
  double occluder_radius = 0;
  double squared_angle = 0;  ///< Square of the angle between the optical axis and the ray to the sample, rad².
  /// Number of the patch: on a face the same in all frames, on a ball while the camera does not turn around it.
  int patch = 0;
};

/// Black ink on a face: it shows the specular reflection of the paper beside it.
struct InkSample {
  int surface = 0;
  double radiance = 0;      ///< Luminance.
  double sigma = 0;         ///< Standard deviation of `radiance` by noise, and its bias.
  double paper_albedo = 0;  ///< Luminance of the albedo of the face's patches.
};

/// A patch of the ground plane: its albedo is unknown, so only radiance is known.
struct GroundSample {
  Vec3d position;
  Rgb color{};
  double radiance = 0;  ///< Mean of the channels.
  double sigma = 0;
  /// Share of the ambient irradiance that the body occludes there, 0 to 1.
  double occluded = 0;
  /// Albedo of the table relative to that of the sample's surface: on a ball's sheet not 1. `color` is without it.
  double table_ratio = 1;
};

/// The plane on which the body stands.
struct GroundPlane {
  Vec3d point;
  Vec3d normal;       ///< Unit, towards the body.
  double step_m = 0;  ///< Between neighbouring samples.
  /// Number of samples in the area of one at the usual step, at least 1. They share the errors of the shadow's model.
  double density = 1;
  std::vector<GroundSample> samples;
};

/// Covariance of the radiance of two points about a lighting model and GroundNeighbours::smooth_terms(), relative to
/// the plane's squared mean radiance: sigma² (correlated exp(-distance / length_m) + (1 - correlated) [same point]);
/// Matérn class with nu = 1/2.
struct GroundTexture {
  double sigma = 0.03;    ///< Standard deviation relative to the plane's mean radiance.
  double correlated = 0;  ///< Share of the variance that is correlated, 0 to 1.
  double length_m = 1;    ///< Correlation length, m.
};

struct Shading {
  std::vector<SurfaceSample> samples;
  std::vector<InkSample> ink;  ///< At most one per face.
  std::optional<GroundPlane> ground;
  /// Points whose convex hull is the body.
  std::vector<Vec3d> hull;
  int channels = 3;  ///< 1: r, g and b are equal in every sample (a grey camera, or grey light).
  /// Standard deviation of the lens's vignetting where it is not calibrated: loss per squared angle, 1/rad²; common to
  /// all samples.
  double vignetting_sigma = 0;
};

/// Sets SurfaceSample::from_ground: the irradiance by the patches of the ground plane (the table), computed from its
/// radiance in the image. Both kinds of samples must be in the same units. Patches that the body or the image's edge
/// hides get the mean radiance of the visible ones at the same distance from the body; the infinite rest of the plane
/// gets that of the outermost ones.
void estimate_ground_reflection(Shading& shading);

/// Subtracts from_ground from the faces' irradiance, at most down to 0, and adds a fifth of it to the samples' sigma in
/// quadrature. For the hypothesis that the surroundings are a ground plane.
void subtract_ground_reflection(Shading& shading);

/// Removes samples of a face that another object or its shadow covers: outliers per flat face. Returns their number.
/// Irradiance along a face is approximately linear: the plane through three samples with the smallest median absolute
/// residual is the fit (Rousseeuw 1984, "Least median of squares regression"). Faces with fewer than six samples are
/// unchanged.
int remove_occluded_samples(Shading& shading);

/// Evenly spaced: the `count` directions of fibonacci_direction(), from +Y to -Y.
[[nodiscard]] inline std::vector<Vec3d> fibonacci_directions(int count) {
  std::vector<Vec3d> out;
  for (int i = 0; i < count; ++i) {
    const Vec3d d = fibonacci_direction(i, count);
    out.push_back({d.y, d.z, d.x});
  }
  return out;
}

/// The lights' directions are from the body's centre: that of its ball, if it has one, else (0, 0, 0) of its frame.
class PosedBody {
 public:
  /// `body` and `model` are referenced and must outlive it. `probe_body`: T_probe_body.
  PosedBody(const MarkerBody& body, const LensParameters& lens, const CameraModel& model, const Pose& probe_body);

  /// Converts a point of the body frame to the probe's axes, relative to the body's centre, m.
  [[nodiscard]] Vec3d at(Vec3d point_of_body) const { return rotate(probe_body_.rotation, point_of_body - center_); }
  [[nodiscard]] Vec3d normal_of(const MarkerFace& face) const {
    return rotate(probe_body_.rotation, rotate(face.body_face.rotation, Vec3d{0, 0, 1}));
  }
  [[nodiscard]] Vec3d point_of(const MarkerFace& face, FacePoint p) const {
    return at(transformed(face.body_face, {p.x, p.y, 0}));
  }
  /// Pose of the body's centre, with the axes of the body's file, in the probe's frame.
  [[nodiscard]] Pose probe_origin() const { return {probe_body_.rotation.normalized(), origin_}; }
  /// Position of the lens relative to the body's centre, m.
  [[nodiscard]] Vec3d lens() const { return lens_; }
  /// Angle between the optical axis and the ray to a point relative to the body's centre, rad.
  [[nodiscard]] double axis_angle(Vec3d point) const { return angle_between(axis_, point - lens_); }
  /// Projects a point relative to the body's centre. nullopt where it is outside of the lens's field of view.
  [[nodiscard]] std::optional<PixelPosition> pixel_of(Vec3d point) const {
    return model_.project(transformed(lens_probe_, point + origin_));
  }
  /// Points whose convex hull is the body, relative to its centre.
  [[nodiscard]] const std::vector<Vec3d>& hull() const { return hull_; }

  /// The face on which the body stands; the only face of a ball's sheet. `up`: unit vector, probe frame, if it is
  /// known: then the face whose normal points down most, null where none is within 50 degrees of down. Otherwise the
  /// most likely face for a camera with a roll of 0 +- 10 degrees, in its image or as the body is seen, 40 +- 20
  /// degrees above the plane (independent normal distributions), null where none is within three sigma.
  [[nodiscard]] const MarkerFace* face_below(std::optional<Vec3d> up) const;
  /// The plane on which the body stands, without samples: that of face_below(). nullopt where there is no such face, or
  /// where the lens is less than 7 degrees above the plane.
  [[nodiscard]] std::optional<GroundPlane> ground_plane(std::optional<Vec3d> up) const;

 private:
  const MarkerBody& body_;
  const CameraModel& model_;
  Pose probe_body_, lens_probe_;
  Vec3d center_, origin_, lens_;
  Vec3d axis_;  // optical axis, probe frame
  /// Axes of the lens's image, probe frame; image_up_ is as near to the probe's +Y as the optical axis allows.
  Vec3d image_right_, image_up_;
  std::vector<Vec3d> hull_;
};

/// Position relative to the body's centre: direction / inverse_distance, for which infinity is a regular value.
struct PointLight {
  Vec3d direction;              ///< Unit vector from the body's centre to the light, probe frame.
  double inverse_distance = 0;  ///< 1/m; 0: distant.
  Rgb irradiance{};             ///< At the body's centre, at normal incidence.
};

struct LightModel {
  /// Irradiance of the ambient light at a normal: ambient[0] + dot((ambient[1], ambient[2], ambient[3]), normal).
  std::array<Rgb, 4> ambient{};
  std::vector<PointLight> lights;  ///< Strongest first.
};

/// Index of the light with the largest luminance; 0 if there is none.
[[nodiscard]] std::size_t strongest(const LightModel& model);

/// Irradiance at `position` (m, from the body's centre) with `normal`, for a point light whose irradiance at the centre
/// is 1: the cosine, clipped at the horizon, divided by the squared distance.
[[nodiscard]] inline double relative_irradiance(Vec3d direction, double inverse_distance, Vec3d position,
                                                Vec3d normal) {
  const Vec3d q = direction - position * inverse_distance;
  const double squared = dot(q, q);
  return std::max(0.0, dot(normal, q)) / (squared * std::sqrt(squared));
}

/// The same for a sample, with the shadow of the sphere that hides lights from it.
[[nodiscard]] double relative_irradiance(Vec3d direction, double inverse_distance, const SurfaceSample& sample);
/// Share of a light that passes the sphere around the origin, 0 to 1. The edge of the shadow is a smooth step.
[[nodiscard]] double sphere_visibility(Vec3d direction, double inverse_distance, const SurfaceSample& sample);

// Standard deviations of the observations, in addition to each sample's own sigma.

/// Of a sample, relative to its irradiance: texture, blur, falloff within a patch.
inline constexpr double kSampleRelativeSigma = 0.005;
/// Of a sample, relative to Observations::max_irradiance(): light from the ground plane varies along a face.
inline constexpr double kSampleSigmaFloor = 0.004;
/// Shared by a surface, relative to its mean irradiance: its attitude and its paper.
inline constexpr double kSurfaceRelativeSigma = 0.007;
/// Shared by a surface, relative to Observations::max_irradiance(): interreflection between surfaces.
inline constexpr double kSurfaceSigmaFloor = 0.015;
/// Of a ground sample at the usual step, relative to the plane's mean radiance: width and position of a shadow's edge.
/// The variance is multiplied by GroundPlane::density.
inline constexpr double kShadowModelSigma = 0.08;
/// Of a ground sample, relative to its radiance times the share of the ambient light that the body occludes there:
/// light that the body reflects onto it.
inline constexpr double kBodyReflectionRelativeSigma = 0.5;
/// Prior standard deviation of each linear coefficient of the ambient light, relative to its constant.
inline constexpr double kAmbientGradientSigma = 1;

}  // namespace lightwell::marker
