// The radiance of the proxy geometry, and its harmonics as seen from any point: the parallax of what is not a light.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <lightwell/harmonics.hpp>

#include "field/proxy.hpp"
#include "field/views.hpp"

namespace lightwell::field {

/// Immutable.
class Surround {
 public:
  static constexpr int kBand = 4;
  static constexpr std::size_t kDirections = 64;

  /// Each texel has the radiance in which the nearest probes see it, weighted by the inverse square of their distances;
  /// the mean of all directions where none sees it. `residuals`: of each view, common scale.
  Surround(std::shared_ptr<const Proxy> proxy, std::span<const ProbeView> views, std::span<const RadianceSh> residuals);

  /// Harmonics up to kBand of the radiance that surrounds `point`, from kDirections rays. Zero where they hit nothing.
  [[nodiscard]] RadianceSh seen_from(Vec3d point) const;

  [[nodiscard]] const Proxy& proxy() const { return *proxy_; }

 private:
  std::shared_ptr<const Proxy> proxy_;
  std::vector<Radiance> texels_;
};

}  // namespace lightwell::field
