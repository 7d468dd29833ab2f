// Selects the number of point lights, and which of them are distant, by the Bayesian information criterion
// (Schwarz 1978).
//   FitCandidates, LightModelSelector
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/light_search.hpp"
#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

struct FitCandidates {
  Fit best;
  std::vector<Fit> others;  ///< The other fits that were tried.
};

/// Of one frame and one set of observations. All constructor arguments are referenced and must outlive it.
class LightModelSelector {
 public:
  LightModelSelector(const Observations& observations, const std::vector<Vec3d>& hull,
                     const LightingEstimateOptions& options, ObservationSet observation_set)
      : observations_(observations), hull_(hull), options_(options), observation_set_(observation_set) {}

  /// Global search for 0 to max_lights lights.
  [[nodiscard]] FitCandidates search();
  /// One fit that starts from the previous frame's lights. nullopt where one of them has disappeared, or where they do
  /// not explain this frame (chi square).
  [[nodiscard]] std::optional<FitCandidates> track(const LightingEstimate& previous);
  /// The grid search, built at first use.
  [[nodiscard]] LightSearch& light_search();

 private:
  [[nodiscard]] const Fit& best() const;
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
  const LightingEstimateOptions& options_;
  ObservationSet observation_set_;
  std::optional<LightSearch> light_search_;
  std::vector<Fit> fits_;
  std::size_t best_ = 0;
};

}  // namespace lightwell::marker
