// Selects the number of point lights of one frame, and which of them are distant.
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
  /// Whether another light is worth a search: not where faces alone are explained to within a fifth of their errors.
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
