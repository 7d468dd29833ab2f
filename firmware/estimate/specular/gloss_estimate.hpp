// From what was captured of a plane to the light around it: roughness, common radiance, environment.
#pragma once

#include <memory>
#include <numbers>
#include <optional>

#include <lightwell/color.hpp>

#include "estimate/specular/gloss_deconvolution.hpp"
#include "estimate/specular/gloss_operator.hpp"
#include "estimate/specular/reflected_radiance.hpp"

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

/// Keeps its memory. Not thread-safe.
class GlossEstimator {
 public:
  /// Null where fewer than 100 texels or no direction was seen; otherwise valid until the next call. The roughness is
  /// searched for where the seen share has grown by a tenth since the last search; that takes about ten times as long
  /// as the rest.
  [[nodiscard]] const GlossEstimate* estimate(const Lumisphere& lumisphere, const TexelImage& diffuse,
                                              const WhiteAlbedo& white);

 private:
  /// Sets the operator, the reflected radiance and the deconvolution.
  void use_roughness(const Lumisphere& lumisphere, double alpha);
  /// Deconvolves with the common radiance that fits best.
  void solve(const DiffuseRange& diffuse, const WhiteAlbedo& white, int rounds);
  void search_roughness(const Lumisphere& lumisphere, const DiffuseRange& diffuse, const WhiteAlbedo& white);

  std::unique_ptr<GlossOperator> gloss_;
  ReflectedRadiance reflected_;
  std::unique_ptr<GlossDeconvolution> deconvolution_;
  CommonRadiance common_;
  GlossEstimate estimate_;
  double seen_at_search_ = 0;
};

}  // namespace lightwell::specular
