// Compares descriptors of a simulated scene with the scene's true irradiance.
#pragma once

#include <map>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "reference/irradiance.hpp"
#include "sim/scene.hpp"

namespace lightwell::hil {

/// Result for one descriptor.
struct Evaluation {
  double error = 0;      ///< The larger of the plain and the luminance-weighted relative RMS error of irradiance.
  double bound = 0;      ///< The descriptor's bound of that error.
  bool flagged = false;  ///< The descriptor states no finite bound.

  [[nodiscard]] bool held() const { return error <= bound; }
};

/// Computes the true irradiance once for each state of the lamps with the reference implementation (tests/reference).
class ErrorEvaluator {
 public:
  explicit ErrorEvaluator(const sim::Scene& scene) : scene_(scene), normals_(reference::fibonacci_normals(2048)) {}

  [[nodiscard]] Evaluation evaluate(const Descriptor& descriptor, const sim::SceneState& state);

 private:
  const sim::Scene& scene_;
  std::vector<reference::V3> normals_;  ///< World frame; they are rotated into the probe's frame for the descriptor.
  std::map<double, std::vector<reference::Rgb>> truth_;  ///< By lamp factor.
};

/// Statistics over a run.
struct Summary {
  std::size_t frames = 0, held = 0, flagged = 0;
  double median_error = 0, largest_error = 0, median_bound_over_error = 0;

  /// There were frames, the bound held in 99 % of them, and at most 10 % were flagged.
  [[nodiscard]] bool good() const { return frames > 0 && 100 * held >= 99 * frames && 10 * flagged <= frames; }
};
[[nodiscard]] Summary summarize(const std::vector<Evaluation>& evaluations);

}  // namespace lightwell::hil
