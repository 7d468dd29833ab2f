// The environment above a glossy plane for one roughness, in steps: operator, deconvolution, common radiance.
#pragma once

#include <memory>
#include <optional>

#include <lightwell/color.hpp>

#include "estimate/specular/gloss_deconvolution.hpp"
#include "estimate/specular/gloss_operator.hpp"
#include "estimate/specular/reflected_radiance.hpp"
#include "estimate/specular/work_budget.hpp"

namespace lightwell::specular {

/// What an estimate of the environment reads.
struct GlossInput {
  Lumisphere lumisphere;
  DiffuseRange diffuse;
  WhiteAlbedo white;
};

/// Luminance of an environment: its irradiance of the plane, its radiance integrated over directions, and the parts of
/// them that are guesses or lower bounds.
struct EnvironmentParts {
  double irradiance = 0, guessed_irradiance = 0, clipped_irradiance = 0;
  double radiance = 0, guessed_radiance = 0;
};
[[nodiscard]] EnvironmentParts parts_of(const GlossEnvironment& environment);

/// Alternates between the environment and the common radiance that fits it. Keeps the operator and the common radiance
/// for the next begin(). Not thread-safe.
class GlossSolver {
 public:
  GlossSolver() = default;
  GlossSolver(const GlossSolver&) = delete;
  GlossSolver& operator=(const GlossSolver&) = delete;

  /// Starts; an unfinished solution is lost. `rounds` deconvolutions, at least 1: all but the last one have half of the
  /// iterations and are followed by a new common radiance. `input` must stay valid until step() returns true.
  void begin(const GlossInput& input, double alpha, int rounds);
  /// Continues until the budget is spent. Returns whether the solution is complete.
  bool step(WorkBudget& budget);
  /// Forgets the common radiance.
  void reset_common() { common_ = {}; }

  // Of a complete solution:
  [[nodiscard]] const GlossDeconvolution& deconvolution() const { return *deconvolution_; }
  [[nodiscard]] const CommonRadiance& common() const { return common_; }
  /// GlossDeconvolution::misfit().
  [[nodiscard]] double misfit() const { return misfit_; }

 private:
  enum class Stage { build, prepare, start, residual, update, end_round, done };
  /// Operations of a stage after `build`.
  [[nodiscard]] std::size_t work_of(Stage stage) const;
  /// Runs a stage after `build`. Returns the next one.
  [[nodiscard]] Stage run(Stage stage);
  void fit_common();

  const GlossInput* input_ = nullptr;
  std::unique_ptr<GlossOperator> gloss_;
  ReflectedRadiance reflected_;
  std::optional<GlossDeconvolution> deconvolution_;  ///< Refers to `*gloss_` and `reflected_`.
  CommonRadiance common_;
  double misfit_ = 0;
  Stage stage_ = Stage::done;
  int rounds_ = 0, iterations_ = 0;  ///< That are left.
};

}  // namespace lightwell::specular
