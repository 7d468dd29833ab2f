// The environment above a glossy plane from its reflection: deconvolution of the gloss lobe.
#pragma once

#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/hemisphere_grid.hpp>

#include "estimate/specular/gloss_operator.hpp"
#include "estimate/specular/reflected_radiance.hpp"

namespace lightwell::specular {

/// The upper hemisphere, in the plane's frame. By node, a mean over its cell; each has grid.size() elements.
struct GlossEnvironment {
  HemisphereGrid grid;
  std::vector<Radiance> radiance;
  /// Share of what the plane would reflect of a cell that was seen, 0 to 1. 0: the radiance is a guess.
  std::vector<float> confidence;
  /// 1: in the mirror direction of a lower bound; the radiance is one, too.
  std::vector<std::uint8_t> lower_bound;
};

/// Irradiance of the plane.
[[nodiscard]] Irradiance plane_irradiance(const GlossEnvironment& environment);

/// Nonnegative weighted least squares: minimises the sum over viewing directions of ((A L - S - c) / sigma)² over L >=
/// 0 by separable quadratic surrogates (Lange & Fessler 1995; De Pierro 1995) with Nesterov's acceleration (Beck &
/// Teboulle 2009, "FISTA"). A is the gloss operator, S the reflected radiance, c the common part. Sigma has a relative
/// part of 2 %. Lower bounds count only where the reflection is darker. Few iterations regularise; a weak quadratic
/// prior keeps cells that no seen direction reflects at their start: the reflection in the mirror direction divided by
/// the gloss' albedo, of the nearest seen direction above.
class GlossDeconvolution {
 public:
  /// Refers to both. The same grid.
  GlossDeconvolution(GlossOperator& gloss, const ReflectedRadiance& reflected);

  /// Restarts with this common part.
  void start(Radiance common);
  void iterate(int iterations);
  /// The two halves of an iteration; each multiplies once by the operator or its transpose.
  void compute_residual();
  void update();
  /// RMS over seen viewing directions of the difference in units of sigma. Computes reflection().
  [[nodiscard]] double misfit();

  [[nodiscard]] const GlossEnvironment& environment() const { return environment_; }
  /// Of the environment, by viewing direction, when misfit() was called last.
  [[nodiscard]] const std::vector<Radiance>& reflection() const { return reflection_; }
  /// d(irradiance of the start) / d(common part): how the irradiance depends on it.
  [[nodiscard]] double irradiance_slope() const { return irradiance_slope_; }

 private:
  void compute_differences();

  GlossOperator& gloss_;
  const ReflectedRadiance& reflected_;
  GlossEnvironment environment_;
  double irradiance_slope_ = 0;
  std::vector<std::uint32_t> seen_from_;  ///< By cell: the viewing direction whose reflection it starts from.
  std::vector<Radiance> start_, target_, extrapolated_, previous_, scratch_, gradient_, reflection_;
  std::vector<float> weight_, curvature_, prior_;
  float momentum_ = 1;
};

}  // namespace lightwell::specular
