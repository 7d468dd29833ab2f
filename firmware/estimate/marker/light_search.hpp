// Where lamps could be, looked for everywhere: sparse least squares over a grid of directions and distances (Aittala
// 2010, "Inverse lighting and photorealistic rendering for augmented reality", section 4: few lamps that explain a
// diffuse probe).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/shadow.hpp"

namespace lightwell::marker {

/// How well lamps at places of the grid explain what was seen, light from all around having been fitted to the rest.
class LightSearch {
 public:
  LightSearch(const Observations& seen, const std::vector<Vec3d>& hull, const FitOptions& options);

  struct Candidate {
    std::vector<PointLight> lights;  ///< Places alone.
    double chi_square = 0;
  };

  /// Best first, none within 25 degrees of a better one, `most` at most. `beside`: lamps whose places are known and
  /// whose irradiances are fitted too.
  [[nodiscard]] std::vector<Candidate> find_single_lights(std::size_t most, ObservationSet observation_set, const std::vector<PointLight>& beside = {});
  /// Two distant lamps at a time.
  [[nodiscard]] std::vector<Candidate> pairs(std::size_t most) const;

  /// What is left of the least squares for a lamp at each direction of the grid, at the distance that suits best,
  /// beside others.
  struct ChiSquareMap {
    std::span<const Vec3d> directions;
    std::vector<double> chi_square;
    std::vector<double> inverse_distance;  ///< That suits best.
    double solid_angle = 0;                ///< Of each direction, sr.
  };
  [[nodiscard]] ChiSquareMap chi_square_map(ObservationSet observation_set, const std::vector<PointLight>& beside);

  /// What is left of the faces' least squares for a lamp that is not a point but as wide as `radius_rad` around its
  /// direction, beside others.
  [[nodiscard]] double chi_square_of(const PointLight& lamp, double radius_rad, const std::vector<PointLight>& beside) const;

 private:
  /// One kind of numbers that were seen: a channel of the faces, or the table. Whitened.
  struct LinearSystem {
    Eigen::MatrixXd basis;  // orthonormal columns of light from all around
    Eigen::VectorXd residual;   // what was seen, without them
    Eigen::MatrixXf
        columns;  // of each direction of the grid, at each distance: what such a lamp would make, without them
  };

  [[nodiscard]] Eigen::VectorXd column_of(int channel, Vec3d direction, double inverse_distance) const;
  [[nodiscard]] Eigen::VectorXd ground_column_of(Vec3d direction, double inverse_distance);
  void build_ground_system();

  const Observations& seen_;
  const std::vector<Vec3d>& hull_;
  double slope_ = 0.5;
  std::vector<LinearSystem> faces_;
  std::optional<LinearSystem> table_;  // made when it is asked for
  Shadow shadow_;
  Eigen::ArrayXd light_;
};

}  // namespace lightwell::marker
