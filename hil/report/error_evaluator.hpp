// Descriptors of a simulated scene against the truth that the scene knows.
#pragma once

#include <map>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "reference/irradiance.hpp"
#include "sim/scene.hpp"

namespace lightwell::hil {

/// One descriptor's judgement.
struct Evaluation {
  double error = 0;  ///< The larger of the plain and the luminance-weighted relative RMS error of irradiance.
  double bound = 0;
  bool flagged = false;  ///< The descriptor says that it cannot state a bound.

  [[nodiscard]] bool held() const { return error <= bound; }
};

/// Works out the true irradiance once for each state of the lamps, by the oracle in tests/reference.
class ErrorEvaluator {
 public:
  explicit ErrorEvaluator(const sim::Scene& scene) : scene_(scene), normals_(reference::fibonacci_normals(2048)) {}

  [[nodiscard]] Evaluation judge(const Descriptor& descriptor, const sim::SceneState& state);

 private:
  const sim::Scene& scene_;
  std::vector<reference::V3> normals_;  ///< In the world: the probe's turn is applied to the descriptor.
  std::map<double, std::vector<reference::Rgb>> truth_;  ///< By lamp factor.
};

/// Over a run.
struct Summary {
  std::size_t frames = 0, held = 0, flagged = 0;
  double median_error = 0, largest_error = 0, median_bound_over_error = 0;

  /// Frames came, the bound held in 99 % of them, and at most 10 % were flagged.
  [[nodiscard]] bool good() const { return frames > 0 && 100 * held >= 99 * frames && 10 * flagged <= frames; }
};
[[nodiscard]] Summary summarize(const std::vector<Evaluation>& verdicts);

}  // namespace lightwell::hil
