// Which lights of different probes are the same light.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "field/views.hpp"

namespace lightwell::field {

struct LightMatches {
  /// Observations of one light each, at most one of a view; two at least, or one with a measured distance.
  std::vector<std::vector<std::size_t>> groups;
  /// Observations that fit several others equally well, in no group.
  std::vector<std::size_t> ambiguous;
};

/// Every pair of lights of neighbouring views is a hypothesis: the point where their rays meet, or a common direction.
/// It is extended by the observation of every other view that fits best. Its score is the logarithm of the likelihood
/// ratio of its observations being one light to their being unrelated lights: distances from the rays, irradiance times
/// squared distance, colour, and views that should see it and do not. Groups are taken by falling score.
[[nodiscard]] LightMatches match_lights(std::span<const ProbeView> views, std::span<const Observation> observations);

}  // namespace lightwell::field
