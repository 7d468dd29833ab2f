// Selection of point lights, from a global search: sparse least squares over a grid of directions and distances
// (Aittala 2010, "Inverse lighting and photorealistic rendering for augmented reality", section 4: few lights that
// explain a diffuse probe).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

/// Chi square of the observations for point lights at the grid's positions. Ambient light and all irradiances are
/// fitted linearly.
class LightSearch {
 public:
  LightSearch(const Observations& observations, const std::vector<Vec3d>& hull);

  struct Candidate {
    std::vector<PointLight> lights;  ///< Directions and inverse distances; irradiances are not set.
    double chi_square = 0;
  };

  /// At most `most` candidates for one light, best first, none within 25 degrees of a better one. `fixed_lights`:
  /// lights at known positions whose irradiances are fitted, too.
  [[nodiscard]] std::vector<Candidate> find_single_lights(std::size_t most, ObservationSet observation_set,
                                                          const std::vector<PointLight>& fixed_lights = {});
  /// At most `most` candidates for two distant lights, best first; uses the faces alone.
  [[nodiscard]] std::vector<Candidate> find_light_pairs(std::size_t most) const;

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

struct FitCandidates {
  Fit best;
  std::vector<Fit> others;  ///< The other fits that were tried.
};

/// Selects the number of point lights, and which of them are distant, by the Bayesian information criterion (Schwarz
/// 1978), for one frame and one set of observations. All constructor arguments are referenced and must outlive it.
class LightModelSelector {
 public:
  LightModelSelector(const Observations& observations, const std::vector<Vec3d>& hull, ObservationSet observation_set)
      : observations_(observations), hull_(hull), observation_set_(observation_set) {}

  /// Global search for 0 to max_lights lights.
  [[nodiscard]] FitCandidates search(int max_lights);
  /// One fit that starts from the previous frame's lights. nullopt where one of them has disappeared, or where they do
  /// not explain this frame (chi square).
  [[nodiscard]] std::optional<FitCandidates> track(const LightingEstimate& previous);
  /// The grid search, built at first use.
  [[nodiscard]] LightSearch& light_search() {
    return light_search_ ? *light_search_ : light_search_.emplace(observations_, hull_);
  }

 private:
  [[nodiscard]] const Fit& best() const { return fits_[best_]; }
  /// Whether another light could reduce BIC: chi square exceeds the penalty of its parameters.
  [[nodiscard]] bool can_improve() const;
  /// Keeps a fit unless one of its lights is too weak.
  void add_fit(Fit fit);
  /// Fits from these positions; all distances are parameters.
  void fit_from(std::vector<PointLight> lights);
  /// Repeats the best fit of `count` lights with all of them distant, and with all but one distant.
  void try_distant(std::size_t count);
  /// Fits with one light more than `lights`, from the best two positions of a search.
  void add_light(std::vector<PointLight> lights);

  const Observations& observations_;
  const std::vector<Vec3d>& hull_;
  ObservationSet observation_set_;
  std::optional<LightSearch> light_search_;
  std::vector<Fit> fits_;
  std::size_t best_ = 0;
};

}  // namespace lightwell::marker
