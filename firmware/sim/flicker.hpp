// Light that swings with the mains, and what a shutter makes of it.
#pragma once

namespace lightwell::sim {

/// All light of a scene, as if its lamps lit everything: L(t) = L (1 + depth sin(2 pi hz t)). Its mean over time is the
/// scene's own radiance.
struct MainsFlicker {
  double hz = 0;     ///< Of the light: twice the mains frequency. 0: steady.
  double depth = 0;  ///< 0 to 1; 1 is dark once a period.

  /// Mean of 1 + depth sin(2 pi hz t) over an exposure of `exposure_s` around `middle_s`: the integral of a sinusoid,
  /// 1 + depth sinc(pi hz exposure) sin(2 pi hz middle). An exposure of 0 s is an instant.
  [[nodiscard]] double factor(double middle_s, double exposure_s) const;
};

}  // namespace lightwell::sim
