// Mains flicker of lamps, and its mean over an exposure.
#pragma once

namespace lightwell::sim {

/// Modulates all radiance of a scene, as if its lamps lit everything: L(t) = L (1 + depth sin(2 pi hz t)). The mean
/// over time is L.
struct MainsFlicker {
  double hz = 0;     ///< Frequency of the light, Hz: twice the mains frequency. 0: steady.
  double depth = 0;  ///< Modulation depth, 0 to 1; with 1 the light is dark once per period.

  /// Mean of 1 + depth sin(2 pi hz t) over an exposure of `exposure_s` centred at `middle_s`:
  /// 1 + depth sinc(pi hz exposure) sin(2 pi hz middle). With an exposure of 0 s, the value at `middle_s`.
  [[nodiscard]] double factor(double middle_s, double exposure_s) const;
};

}  // namespace lightwell::sim
