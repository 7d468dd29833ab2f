// Which light the marker tells of: as many lamps as it takes, near where that shows, and how sure all of it is.
//   LightingEstimateOptions, Around, LightingEstimate, estimate_lighting
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "estimate/marker/fit_options.hpp"
#include "estimate/marker/light_model.hpp"

namespace lightwell::marker {

struct LightingEstimateOptions {
  ErrorModel errors;
  FitOptions fit;
  int max_lights = 3;
  /// A lamp whose direction is less sure than this (standard deviation along the worse axis) is called so.
  double max_direction_sigma_rad = 0.15;
  /// Samples further from the model than so many standard deviations are something else (another object, its shadow).
  double outlier = 4.5;
};

/// What the plane around the body was taken for.
enum class SurroundModel : std::uint8_t {
  distant,     ///< No table: what is seen there is far away, and a part of the light.
  ground_plane,   ///< A table that shows no shadow. What it sends to the faces is no lamp's.
  ground_plane_with_shadow,  ///< A table whose shadow was a witness too.
};

struct LightEstimate {
  PointLight lamp;
  /// In tangent_basis(direction), rad²; other models and places that explain what was seen as well are in it.
  std::array<double, 3> direction_covariance{};  ///< u·u, u·v, v·v
  std::array<double, 3> model_covariance{};             ///< What of it other models added when lamps were last searched for.
  double inverse_distance_sigma = 0;             ///< 1/m; infinite where the distance was not told.
  bool near = false;                             ///< Whether the distance shows.
  bool unsure = false;                           ///< Whether the direction does not.
  bool free = false;                             ///< Whether its distance was looked for.
};

struct LightingEstimate {
  std::array<Rgb, 4> ambient{};
  std::vector<LightEstimate> lights;  ///< Strongest first.
  double chi_square = 0;          ///< Over the degrees of freedom.
  double searched = 0;            ///< The same when lamps were last searched for.
  SurroundModel around = SurroundModel::distant;
  bool unsure = false;  ///< Whether several lights would explain what was seen equally well.
  /// Whether the lamps explain the faces from where they are, each within `max_direction_sigma_rad`, with no less than nothing from
  /// all around, or the table's shadow shows them: then they tell what normals between the faces get, also where it is
  /// open how wide a lamp is.
  bool placed = false;
  int outliers = 0;  ///< Samples that were something else.
  int used = 0;
  bool followed = false;            ///< Whether the lamps before were led on; else they were searched for everywhere.
  std::vector<SurfaceSample> inliers;  ///< The faces' samples without those that were something else.
};

/// `before`: what was told of the frame before, where there was one: its lamps are led on while they explain what is
/// seen as well as they did, a tenth of the time of a search. With nothing seen: no lamps, unsure.
[[nodiscard]] LightingEstimate estimate_lighting(const Shading& shading, const LightingEstimateOptions& options,
                                       const LightingEstimate* before = nullptr);

}  // namespace lightwell::marker
