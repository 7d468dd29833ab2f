// Errors of frames and the bounds that their descriptors state.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>

namespace lightwell::measure {

/// Frames with an infinite bound count as flagged, neither as held nor as missed.
struct BoundStatistics {
  int frames = 0, flagged = 0, held = 0;
  double worst_error = 0;
  std::vector<double> errors, bounds, ratios;  ///< Of frames that are not flagged; bound divided by error.

  void add(double error, double bound) {
    ++frames;
    if (!std::isfinite(bound)) {
      ++flagged;
      return;
    }
    held += error <= bound ? 1 : 0;
    worst_error = std::max(worst_error, error);
    errors.push_back(error);
    bounds.push_back(bound);
    ratios.push_back(error > 0 ? bound / error : 1e9);
  }
  void add(const BoundStatistics& other) {
    frames += other.frames;
    flagged += other.flagged;
    held += other.held;
    worst_error = std::max(worst_error, other.worst_error);
    errors.insert(errors.end(), other.errors.begin(), other.errors.end());
    bounds.insert(bounds.end(), other.bounds.begin(), other.bounds.end());
    ratios.insert(ratios.end(), other.ratios.begin(), other.ratios.end());
  }
  /// Quantiles are null without a frame that is not flagged.
  [[nodiscard]] nlohmann::json json() const {
    return {{"frames", frames},
            {"flagged", flagged},
            {"held", held},
            {"median_error", upper_quantile(std::vector(errors), 0.5)},
            {"worst_error", worst_error},
            {"median_bound", upper_quantile(std::vector(bounds), 0.5)},
            {"median_ratio", upper_quantile(std::vector(ratios), 0.5)},
            {"least_ratio", upper_quantile(std::vector(ratios), 0)}};
  }
};

}  // namespace lightwell::measure
