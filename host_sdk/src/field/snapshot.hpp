// The field of one update, immutable: what queries read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <lightwell/field.hpp>
#include <lightwell/harmonics.hpp>

#include "field/intensity.hpp"
#include "field/place.hpp"
#include "field/surround.hpp"
#include "field/triangulate.hpp"

namespace lightwell::field {

/// A light that all probes share.
struct SharedLight {
  std::uint32_t id = 0;
  bool distant = false;
  Vec3d position;
  Symmetric3 covariance{};
  Vec3d direction;
  double direction_sigma_rad = 0, parallax_sigma = 0;
  double radius = 0;  ///< m; distant: rad.
  Vec3d center;       ///< Of the probes that see a distant light: its direction and its parallax are from there.
  IntensityModel intensity;
  /// The geometry does not contradict the probes that see it, so that it decides from where the light is hidden.
  bool occluded_by_geometry = false;
};

/// A probe that takes part.
struct FieldNode {
  Vec3d position;
  RadianceSh residual;  ///< Without shared and own lights; minus Surround::seen_from(position), if any.
  IrradianceSh residual_irradiance;
  std::vector<Light> own_lights;  ///< Matched with none, world axes, common scale.
  double own_square = 0;          ///< Mean square over normals of the irradiance of these (luminance).
  double rest_square = 0;         ///< The same of residual and own lights, with the surroundings.
  std::vector<float> visibility;  ///< Of each shared light, 0 to 1.
  float bound = 0;                ///< Of its descriptor.
  Flags flags;
  Setting setting = Setting::balanced;
  HostTime mid_exposure;
  Duration time_uncertainty;
  bool contradicted = false;
};

/// Weights of the probes at a point: inverse squared distances of the nearest ones, which fall to zero at the distance
/// of the first that is left out (Franke & Nielson 1980, "Smooth interpolation of large sets of scattered data"). The
/// weights add up to one.
struct Weights {
  static constexpr std::size_t kNearest = 8;
  std::size_t count = 0;
  std::array<std::size_t, kNearest> node{};
  std::array<double, kNearest> weight{}, distance_m{};
};

struct FieldSnapshot {
  std::shared_ptr<const FieldState> state;
  FieldOptions options;
  std::vector<SharedLight> lights;
  std::vector<FieldNode> nodes;
  /// Mean squared difference of irradiance (luminance) of two places h apart: variogram h^1.5 (twice the
  /// semivariogram).
  double variogram = 0;
  std::shared_ptr<const Surround> surround;

  [[nodiscard]] FieldAnswer at(Vec3d position, HostTime now) const;
  [[nodiscard]] Answer<Irradiance> irradiance(Vec3d position, Vec3f normal, HostTime now) const;
  [[nodiscard]] Weights weights_at(Vec3d position) const;
};

/// Exponent of the variogram, that of a random field between one without slopes (1) and a smooth one (2).
[[nodiscard]] double variogram_shape(double distance_m);

}  // namespace lightwell::field
