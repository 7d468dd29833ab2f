// Chi square of point lights over a grid of directions and distances: sparse least squares (Aittala 2010, "Inverse
// lighting and photorealistic rendering for augmented reality", section 4: few lights that explain a diffuse probe).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/observations.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Directions farther apart than this (25 degrees) are different modes of the likelihood. Two candidates are distinct
/// where a light of one is farther than this from all lights of the other.
inline constexpr double kMinSeparation_rad = 0.43;

/// Chi square for point lights at the grid's positions. Ambient light and all irradiances are fitted linearly.
class LightSearch {
 public:
  LightSearch(const Observations& observations, const std::vector<Vec3d>& hull);

  struct Candidate {
    std::vector<PointLight> lights;  ///< Directions and inverse distances; irradiances are not set.
    double chi_square = 0;
  };

  /// At most `most` candidates for one light, best first, 25 degrees apart; also fits `fixed_lights`' irradiances.
  [[nodiscard]] std::vector<Candidate> find_single_lights(std::size_t most, ObservationSet observation_set,
                                                          const std::vector<PointLight>& fixed_lights = {});
  /// At most `most` candidates for two distant lights, best first.
  [[nodiscard]] std::vector<Candidate> find_light_pairs(std::size_t most, ObservationSet observation_set);

  /// Smallest chi square over the grid's distances, for a light in each direction of the grid.
  struct ChiSquareMap {
    std::span<const Vec3d> directions;
    std::vector<double> chi_square;
    std::vector<double> inverse_distance;  ///< Of the minimum, 1/m.
    double solid_angle = 0;                ///< Per direction, sr.
  };
  [[nodiscard]] ChiSquareMap chi_square_map(ObservationSet observation_set,
                                            const std::vector<PointLight>& fixed_lights);

  /// Chi square of the faces for a uniform disc of angular radius `radius_rad` in place of the point light.
  [[nodiscard]] double chi_square_of(const PointLight& light, double radius_rad,
                                     const std::vector<PointLight>& fixed_lights) const;

 private:
  /// Whitened linear system of one channel of the faces, or of the ground plane.
  struct LinearSystem {
    Eigen::MatrixXd basis;     // orthonormal columns that span the ambient light
    Eigen::VectorXd residual;  // observations, projected off the basis
    Eigen::MatrixXf columns;  // response to a light at each direction and distance of the grid, projected off the basis

    template <class ColumnOf>
    void fill_columns(const ColumnOf& column_of);
    template <class ColumnOf>
    [[nodiscard]] Eigen::MatrixXd basis_of(const std::vector<PointLight>& lights, const ColumnOf& column_of) const;
  };

  [[nodiscard]] Eigen::VectorXd column_of(int channel, Vec3d direction, double inverse_distance) const;
  [[nodiscard]] Eigen::VectorXd ground_column_of(Vec3d direction, double inverse_distance);
  void build_ground_system();

  const Observations& observations_;
  const std::vector<Vec3d>& hull_;
  std::vector<LinearSystem> face_systems_;
  std::optional<LinearSystem> ground_system_;  // built at first use
  Shadow shadow_;
  Eigen::ArrayXd unit_irradiance_;
};

}  // namespace lightwell::marker
