// How many lamps, where, and which of them distant: the fit that Schwarz's criterion takes, and those that it did not.
//   FitCandidates, LightModelSelector
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/light_fit.hpp"
#include "estimate/marker/light_search.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

struct FitCandidates {
  Fit best;
  std::vector<Fit> others;  ///< What else was tried.
};

/// Of one frame, as one witness or both saw it. Refers to all that it is made of.
class LightModelSelector {
 public:
  LightModelSelector(const Observations& seen, const std::vector<Vec3d>& hull, const LightingEstimateOptions& options, ObservationSet observation_set)
      : seen_(seen), hull_(hull), options_(options), observation_set_(observation_set) {}

  /// Lamps looked for everywhere.
  [[nodiscard]] FitCandidates seek();
  /// The lamps of the frame before, from where they were. Nothing where one of them is gone, or where they do not
  /// explain this frame.
  [[nodiscard]] std::optional<FitCandidates> follow(const LightingEstimate& before);
  [[nodiscard]] LightSearch& search();

 private:
  [[nodiscard]] const Fit& best() const;
  /// Whether another lamp could pay for its parameters.
  [[nodiscard]] bool can_improve() const;
  void add_fit(Fit fit);
  /// From these places, each lamp as near as it likes.
  void fit_from(std::vector<PointLight> lights);
  /// The best fit of so many lamps again with all of them, and each one, infinitely far: what a distance does not pay
  /// for is distant.
  void try_distant(std::size_t count);
  void add_light(std::vector<PointLight> lights);

  const Observations& seen_;
  const std::vector<Vec3d>& hull_;
  const LightingEstimateOptions& options_;
  ObservationSet observation_set_;
  std::optional<LightSearch> search_;
  std::vector<Fit> fits_;
  std::size_t best_ = 0;
};

}  // namespace lightwell::marker
