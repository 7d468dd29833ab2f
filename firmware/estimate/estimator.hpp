// From a bracket of frames to a descriptor: the one interface of all sources of light.
#pragma once

#include <span>

#include <lightwell/config.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"
#include "estimate/common/clipped_energy.hpp"

namespace lightwell {

/// How radiance is scaled on its way out.
struct RadianceScale {
  Units units = Units::relative;
  double factor = 1;  ///< Descriptor radiance per unit of (linear value / (exposure_s * gain * vignetting)).
};

/// One thread at a time. Holds all memory that it needs from the start: estimate() allocates nothing.
class Estimator {
 public:
  virtual ~Estimator() = default;

  /// Fills `out` (whose memory is used again) from the exposures of one bracket, in order; a single frame is a bracket
  /// of one. Everything but the time of encoding is set. invalid_argument where a frame does not fit the calibration
  /// (size, lens, format); `out` then holds nothing of use. Bad light is no error: it comes out flagged.
  [[nodiscard]] virtual Status estimate(std::span<const Frame> bracket, Descriptor& out) = 0;

  /// Which options it has: see option_names() and settings_of().
  [[nodiscard]] virtual EstimatorKind kind() const = 0;
  /// Takes effect with the next estimate; the tracks of lights go on. invalid_argument, which names an option that is
  /// out of its range or not one of this estimator's, leaves all as it was.
  [[nodiscard]] virtual Status configure(const EstimatorConfig& config) = 0;
  virtual void set_scale(RadianceScale scale) = 0;
  [[nodiscard]] virtual RadianceScale scale() const = 0;

  /// Of the last estimate: lights of it that were saturated in every exposure. Empty where nothing was, or where what
  /// was is no light: then no reading can recover it.
  [[nodiscard]] virtual std::span<const ClippedLight> clipped_lights() const { return {}; }
  /// Takes effect with the next estimate, and lasts for each light as long as it is clipped without a break and the
  /// scale stays. What recover() made of the last estimate's descriptor and clipped_lights().
  virtual void set_recovery(const Recovery& recovery) { (void)recovery; }
};

}  // namespace lightwell
