// Selection of point lights, from a global search: sparse least squares over a grid of directions and distances
// (Aittala 2010, "Inverse lighting and photorealistic rendering for augmented reality", section 4: few lights that
// explain a diffuse probe).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/observations.hpp"
#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

enum class Distance : std::uint8_t { infinite, free };

/// A fitted model with its covariance and goodness of fit.
struct Fit {
  LightModel model;
  std::vector<Distance> distances;  ///< Of each light: whether its distance is a parameter.
  /// Of each light: direction in tangent_basis(direction) (rad, 2 rows) and inverse distance (1/m). Multiplied by
  /// dispersion().
  std::vector<Eigen::Matrix3d> covariance;
  double chi_square = 0;         ///< Of all residuals and of the priors.
  double face_chi_square = 0;    ///< Of the faces' samples alone.
  double ground_chi_square = 0;  ///< Of the ground's samples alone.
  double ground_deviance = 0;    ///< GroundObservations::marginal_deviance(); 0 after tracking.
  int parameters = 0;
  int observations = 0;
  int face_samples = 0;       ///< Samples, each of all channels: the channels have the same errors.
  double ground_samples = 0;  ///< At the usual step: GroundPlane::density samples count as one.
  int channels = 1;
  bool ground = false;  ///< Whether the ground plane's samples were fitted, too.
  /// Radiance of the ground plane, if fitted: by the ambient light alone, and by each light, unshadowed, at its normal.
  double ground_ambient = 0;
  std::vector<double> ground_irradiance;

  /// Factor of all variances, at least 1: the reduced chi square relative to that of pictures that the model explains
  /// (the overdispersion of Burnham & Anderson 2002, "Model Selection and Multimodel Inference", section 2.5).
  [[nodiscard]] double dispersion() const;
  /// The same for the faces' samples alone; may be below 1.
  [[nodiscard]] double face_dispersion() const;
  /// Minus twice the logarithm of the likelihood, up to a constant. The errors of the faces have an unknown common
  /// factor: a multivariate t distribution (Lange, Little & Taylor 1989, "Robust statistical modeling using the t
  /// distribution", eq. 1). Those of the ground have the likeliest texture: ground_deviance.
  [[nodiscard]] double deviance() const;
  /// Bayesian information criterion (Schwarz 1978), up to a constant.
  [[nodiscard]] double bic() const;
};

/// Observations that a fit uses.
enum class ObservationSet : std::uint8_t { faces, faces_and_ground_plane };

inline constexpr int kMaxFitIterations = 40;

/// Fits to the local minimum nearest to the start. `lights`: directions and inverse distances of the start; their
/// irradiances are ignored. `hull`: points whose convex hull is the body, m, from its centre.
[[nodiscard]] Fit fit_lights(const Observations& observations, std::vector<PointLight> lights,
                             std::vector<Distance> distances, ObservationSet observation_set,
                             const std::vector<Vec3d>& hull, int max_iterations = kMaxFitIterations);

/// Residual of each face sample in standard deviations, of the channel in which it is largest.
[[nodiscard]] std::vector<double> standardized_residuals(const Observations& observations, const LightModel& model);
/// Residual radiance of each ground sample; none where no ground plane was sampled.
[[nodiscard]] Eigen::ArrayXd ground_residuals(const Observations& observations, const Fit& fit,
                                              const std::vector<Vec3d>& hull);

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
  /// One fit from the previous frame's lights; nullopt where add_fit() rejects it or it does not explain this frame.
  [[nodiscard]] std::optional<FitCandidates> track(const LightingEstimate& previous);
  /// The grid search, built at first use.
  [[nodiscard]] LightSearch& light_search() {
    return light_search_ ? *light_search_ : light_search_.emplace(observations_, hull_);
  }

 private:
  [[nodiscard]] const Fit& best() const { return fits_[best_]; }
  /// Whether another light could reduce BIC: chi square exceeds the penalty of its parameters.
  [[nodiscard]] bool can_improve() const;
  /// Keeps a fit unless one of its lights is too weak or, with the ground plane, below it, or the plane would reflect
  /// very different shares of the lights.
  void add_fit(Fit fit);
  /// Fits from these positions; all distances are parameters.
  void fit_from(std::vector<PointLight> lights);
  /// Repeats the best fit of `count` lights with all of them distant, and with all but one distant.
  void try_distant(std::size_t count);
  /// The likeliest fit with `count` lights; null if there is none.
  [[nodiscard]] const Fit* best_of_count(std::size_t count) const;
  /// Fits with one light more than `fit`, from the best three positions of a search; nothing if it is null.
  void add_light(const Fit* fit);
  /// Searches each light of the likeliest fit with `count` lights again, the others fixed, and fits from there, until
  /// nothing improves.
  void exchange_lights(std::size_t count);

  const Observations& observations_;
  const std::vector<Vec3d>& hull_;
  ObservationSet observation_set_;
  std::optional<LightSearch> light_search_;
  std::vector<Fit> fits_;
  std::size_t best_ = 0;
};

}  // namespace lightwell::marker
