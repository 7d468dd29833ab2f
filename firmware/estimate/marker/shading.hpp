// What a marker shows of the light, as values: how bright its faces and the table around it are, and where they are.
//   SurfaceSample   a small part of a face: its paper is known, so it tells irradiance
//   GroundSample     a small part of the table: its paper is unknown, so it tells where light is missing
//   Shading         all of them, and the body that casts the shadow
// Axes: the probe's, origin in the body's centre. Metres.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <lightwell/geometry.hpp>

namespace lightwell::marker {

/// r, g, b, linear.
using Rgb = std::array<double, 3>;

/// Rec. 709.
[[nodiscard]] inline double luminance(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

struct SurfaceSample {
  Vec3d position;
  Vec3d normal;    ///< Unit, outwards.
  Rgb irradiance;  ///< pi * radiance / albedo.
  Rgb sigma;       ///< Standard deviation of what is this sample's alone: noise of the sensor, texture of the paper.
  int surface =
      0;  ///< Samples of one surface share an error too: of its attitude, its paper, light from its neighbours.
  Rgb from_ground{};  ///< What of the irradiance comes from the table, if what is seen around the body is one.
};

struct GroundSample {
  Vec3d position;
  Rgb color{};
  double radiance = 0;  ///< Mean of the channels.
  double sigma = 0;
  /// Share of the light from all around that the body takes away there, 0 to 1.
  double occluded = 0;
};

/// The plane that the body stands on.
struct GroundPlane {
  Vec3d point;
  Vec3d normal;       ///< Unit, to the body's side.
  double step_m = 0;  ///< Between neighbouring samples.
  std::vector<GroundSample> samples;
};

struct Shading {
  std::vector<SurfaceSample> samples;
  std::optional<GroundPlane> table;
  /// Points whose convex hull is the body.
  std::vector<Vec3d> hull;
  int channels = 3;  ///< 1: of a grey camera; then r, g and b are the same.
};

}  // namespace lightwell::marker
