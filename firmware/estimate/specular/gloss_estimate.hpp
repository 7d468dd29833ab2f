// From what was captured of a plane to the light around it: roughness, common radiance, environment.
#pragma once

#include <cstddef>
#include <numbers>
#include <optional>

#include <lightwell/color.hpp>

#include "estimate/specular/gloss_deconvolution.hpp"
#include "estimate/specular/gloss_solver.hpp"
#include "estimate/specular/reflected_radiance.hpp"
#include "estimate/specular/roughness_search.hpp"

namespace lightwell::specular {

/// Elevation below which directions do not count as missing, where no frame saw them: the circle of Jachnik et al.
/// 2012, figure 8.
inline constexpr double kGrazing_rad = 10 * std::numbers::pi / 180;

struct GlossEstimate {
  /// False: the plane reflects nothing specularly that exceeds the errors. The environment is then uniform, with the
  /// irradiance that the diffuse texture lets expect.
  bool glossy = false;
  double alpha = 0.1;  ///< Square of the perceptual roughness.
  GlossEnvironment environment;
  Radiance common;  ///< Part of the diffuse texture that is specular.
  Radiance plane;   ///< Mean diffuse radiance of the plane.
  /// Share of the directions above kGrazing_rad whose reflection was seen, 0 to 1.
  double seen = 0;
  /// Share of the seen directions above kGrazing_rad whose reflection was saturated, 0 to 1.
  double saturated = 0;
  /// Share of the irradiance that was added to lower bounds, because the diffuse texture shows it; 0 to 1. How it is
  /// divided among them is a guess.
  double recovered = 0;
  /// Standard deviation of the environment's scale, relative to the irradiance: common radiance, albedo of white.
  double scale_sigma = 0;
  /// Share of the radiance above the plane, integrated over directions, that is a guess because no frame saw its
  /// reflection; 0 to 1.
  double guessed = 0;
  double misfit = 0;  ///< GlossDeconvolution::misfit().
};

/// An environment that is uniform above the plane, from the brightest texels. nullopt where fewer than 100 were seen.
[[nodiscard]] std::optional<GlossEstimate> uniform_estimate(const TexelImage& diffuse, const WhiteAlbedo& white);

/// Estimates in steps, so that the time of an estimate can be divided among frames. The inputs are copied: what is
/// captured meanwhile belongs to the next estimate. Not thread-safe.
class GlossEstimator {
 public:
  /// Begins an estimate; an unfinished one is lost. Ends it at once where the plane is matte, or where fewer than 100
  /// texels or no direction was seen. Takes the time of about two million operations.
  void begin(const Lumisphere& lumisphere, const TexelImage& diffuse, const WhiteAlbedo& white);
  [[nodiscard]] bool running() const { return running_; }
  /// Continues the estimate until `operations` (WorkBudget) are spent, and at least by one part: an iteration of the
  /// deconvolution, at most kMaxPart operations, or a row of the operator, which may exceed `operations`. Returns how
  /// many were spent. The result does not depend on the size of the steps.
  std::size_t step(std::size_t operations);
  /// The last finished estimate, valid until the next one ends; null before the first, and where too little was seen.
  [[nodiscard]] const GlossEstimate* last() const { return estimate_ ? &*estimate_ : nullptr; }

  /// The same in one step. The roughness is searched for where the seen share has grown by a tenth since the last
  /// search.
  [[nodiscard]] const GlossEstimate* estimate(const Lumisphere& lumisphere, const TexelImage& diffuse,
                                              const WhiteAlbedo& white);

  /// Operations of an iteration at any roughness.
  static constexpr std::size_t kMaxPart = 2'700'000;

 private:
  void continue_search();
  /// From the solution to the estimate.
  void finish();

  GlossInput input_;
  GlossSolver solver_;
  std::optional<RoughnessSearch> search_;  ///< Empty: the solver has the last roughness.
  double alpha_ = GlossEstimate().alpha, seen_at_search_ = 0;
  GlossEstimate next_;
  std::optional<GlossEstimate> estimate_;
  bool running_ = false;
};

}  // namespace lightwell::specular
