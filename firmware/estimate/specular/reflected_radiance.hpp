// What a plane reflects specularly, at the viewing directions of a gloss operator, and the part of it that all
// directions have in common, which the separation leaves in the diffuse texture.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/hemisphere_grid.hpp>

#include "estimate/specular/gloss_operator.hpp"
#include "estimate/specular/lumisphere.hpp"
#include "estimate/specular/plane_texels.hpp"

namespace lightwell::specular {

/// By node of a hemisphere; each has grid.size() elements.
struct ReflectedRadiance {
  HemisphereGrid grid;
  std::vector<Radiance> value;
  std::vector<float> sigma;  ///< Standard deviation of the luminance; infinite: no frame saw the direction.
  std::vector<std::uint8_t> lower_bound;  ///< 1: saturated, the value is a lower bound.

  [[nodiscard]] bool seen(std::size_t node) const { return sigma[node] < std::numeric_limits<float>::infinity(); }
};

/// Interpolates a lumisphere. The sigma of a mean over texels is a tenth of their scatter, and more where that is
/// large: errors of a frame's pose are common to its texels (measured against the reference renderer).
[[nodiscard]] ReflectedRadiance sample(const Lumisphere& lumisphere, const HemisphereGrid& grid);

/// Quantiles over the texels of a diffuse texture, by channel.
struct DiffuseRange {
  Radiance dark, bright;  ///< The 1 % and the 99 % quantile.
};
/// nullopt where fewer than 100 texels were seen.
[[nodiscard]] std::optional<DiffuseRange> diffuse_range(const TexelImage& diffuse);

/// Specular radiance that the separation left in the diffuse part.
struct CommonRadiance {
  Radiance value;
  float sigma = 0;  ///< Standard deviation of its luminance.
};

/// Albedo of the plane's brightest texels: paper is 0.7 to 0.9.
struct WhiteAlbedo {
  double value = 0.8, sigma = 0.1;
};
/// Of an albedo that is known.
inline constexpr double kGivenAlbedoSigma = 0.02;

/// Irradiance of the environment that is reflected, as a function of the common radiance c: without_common + slope c.
struct CommonIrradiance {
  Irradiance without_common;
  double slope = 0;  ///< pi / (albedo of the gloss), about 70.
  double sigma = 0;  ///< Of the luminance of without_common: directions that were not seen, or that were saturated.
};

/// Least squares of three things that depend on it: (1) Fresnel's rise: the darker quarter of the
/// environment, if it changes little with elevation, is reflected in proportion to the gloss' albedo, from its level at
/// normal incidence to ten times as much at grazing angles; (2) the irradiance of the environment that is reflected
/// makes the brightest texels as bright as their albedo lets expect; (3) it is at least 0 and at most the darkest
/// texels' radiance, and the irradiance is at most what texels of an albedo a standard deviation lower would show. That
/// is the luminance; its colour is the one with which the plane is lit in the colour of its brightest texels.
[[nodiscard]] CommonRadiance common_radiance(const GlossOperator& gloss, const ReflectedRadiance& reflected,
                                             const DiffuseRange& diffuse, const WhiteAlbedo& white,
                                             const CommonIrradiance& irradiance);

}  // namespace lightwell::specular
