// From what was captured of a plane to the light around it: roughness, common radiance, environment.
#pragma once

#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

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
  /// True: alpha is a guess, no search for it has ended.
  bool provisional = false;
  double alpha = 0.1;  ///< Square of the perceptual roughness.
  GlossEnvironment environment;
  /// By viewing direction, a node of environment.grid: what the plane reflects of the environment (before saturated
  /// lights are recovered), without `common`. Empty where it is not glossy.
  std::vector<Radiance> reflection;
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

  /// What the plane reflects towards a direction, as far as the environment tells: where no frame saw it, because the
  /// lobe mixes what it mirrors into directions that were seen. nullopt while the roughness is a guess, and where
  /// nothing is glossy.
  [[nodiscard]] std::optional<Radiance> predicted(Vec3f to_viewer) const;
};

/// An environment that is uniform above the plane, from the brightest texels. nullopt where fewer than 100 were seen.
[[nodiscard]] std::optional<GlossEstimate> uniform_estimate(const TexelImage& diffuse, const WhiteAlbedo& white);

/// How an estimate finds the roughness.
enum class RoughnessMode {
  /// For a stream: one roughness for each estimate. While few directions were seen it is 0.1; then successive estimates
  /// are the evaluations of a search; then it is searched for again, from the last answer on, each time the seen share
  /// has grown by a twentieth.
  track,
  search,  ///< With all evaluations of a search: takes five times as long.
};

/// Estimates in steps, so that the time of an estimate can be divided among frames. The inputs are copied: what is
/// captured meanwhile belongs to the next estimate. Not thread-safe.
class GlossEstimator {
 public:
  /// Begins an estimate; an unfinished one is lost. Ends it at once where the plane is matte, or where fewer than 100
  /// texels or no direction was seen. Takes the time of about two million operations.
  void begin(const Lumisphere& lumisphere, const TexelImage& diffuse, const WhiteAlbedo& white, RoughnessMode mode);
  [[nodiscard]] bool running() const { return running_; }
  /// A search for the roughness has not ended: the next estimate continues it.
  [[nodiscard]] bool searching() const { return search_.has_value(); }
  /// Continues the estimate until `operations` (WorkBudget) are spent, and at least by one part: half of an iteration
  /// of the deconvolution, at most kMaxPart operations, or a row of the operator, which may exceed `operations`.
  /// Returns how many were spent. The result does not depend on the size of the steps.
  std::size_t step(std::size_t operations);
  /// The last finished estimate, valid until the next one ends. Null before the first, and where too little was seen.
  [[nodiscard]] const GlossEstimate* last() const { return estimate_ ? &*estimate_ : nullptr; }

  /// Begins an estimate with a search and finishes it.
  [[nodiscard]] const GlossEstimate* estimate(const Lumisphere& lumisphere, const TexelImage& diffuse,
                                              const WhiteAlbedo& white);

  /// Operations of a part at any roughness.
  static constexpr std::size_t kMaxPart = 2'800'000;

 private:
  /// After the solution for a roughness: the estimate, or the next roughness.
  void end_solution();
  [[nodiscard]] GlossEstimate conclude() const;

  GlossInput input_;
  double seen_ = 0, saturated_ = 0;  ///< Of the input, as in GlossEstimate.
  Radiance mean_diffuse_;
  RoughnessMode mode_ = RoughnessMode::track;
  std::optional<RoughnessSearch> search_;  ///< Under way.
  double alpha_ = GlossEstimate().alpha;   ///< Of the solver, or of the next estimate.
  double seen_at_search_ = 0;              ///< When the last search ended; 0: none has.
  GlossSolver solver_;
  std::optional<GlossEstimate> estimate_;
  bool running_ = false;
};

}  // namespace lightwell::specular
