// Interface of the estimators: a bracket of frames in, a lighting descriptor out. Header fields of all descriptors.
#pragma once

#include <cstdint>
#include <span>

#include <lightwell/captured_plane.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/result.hpp>

#include "estimate/common/clipped_energy.hpp"
#include "imaging/frame.hpp"

namespace lightwell {

/// Units and scale of the radiance in a descriptor.
struct RadianceScale {
  Units units = Units::relative;
  double factor = 1;  ///< Descriptor radiance per unit of (linear value / (exposure_s * gain * vignetting)).
};

/// Not thread-safe: one thread at a time. The panorama estimator's estimate() allocates no memory.
class Estimator {
 public:
  virtual ~Estimator() = default;

  /// Fills `out` (its memory is reused) from the exposures of one bracket, in order; a single frame is a bracket of
  /// one. Sets everything except the time of encoding. Returns invalid_argument where a frame does not match the
  /// calibration (size, lens, format); `out` is then unspecified. Poor light (dark, clipped) is not an error: it sets
  /// flags.
  [[nodiscard]] virtual Status estimate(std::span<const Frame> bracket, Descriptor& out) = 0;

  /// The kind, which determines the options: see fields_of() and settings_of().
  [[nodiscard]] virtual EstimatorKind kind() const = 0;
  /// Takes effect with the next estimate; light tracks persist. Returns invalid_argument, naming the option, where an
  /// option is out of range or belongs to another estimator; the configuration is then unchanged.
  [[nodiscard]] virtual Status configure(const EstimatorConfig& config) = 0;
  virtual void set_scale(RadianceScale scale) = 0;
  [[nodiscard]] virtual RadianceScale scale() const = 0;

  /// Lights of the last estimate that were saturated in every exposure. Empty where no pixel was, or where the
  /// saturated pixels belong to no light: a meter reading cannot recover their energy then.
  [[nodiscard]] virtual std::span<const ClippedLight> clipped_lights() const { return {}; }
  /// `recovery`: the result of recover() for the last estimate's descriptor and clipped_lights(). Takes effect with the
  /// next estimate, and applies to each light as long as it stays clipped in every frame and the scale is unchanged.
  virtual void set_recovery(const Recovery& recovery) { (void)recovery; }

  /// The plane as captured up to the last estimate(), also where that failed; null if the estimator captures none, or
  /// nothing yet. Takes a few milliseconds. Valid until the next call of a member.
  [[nodiscard]] virtual const CapturedPlane* captured_plane() { return nullptr; }
};

namespace estimate {

struct DescriptorHeader {
  Units units = Units::relative;
  std::uint32_t probe_id = 0, calibration_id = 0;
  Setting setting = Setting::balanced;
};

/// Sets sequence, times, units, identities and setting of `out`, and its origin to the probe. The sequence counts
/// captures; a bracket is one capture, so that descriptors of brackets are numbered without gaps. The time is the
/// middle between the first and the last mid-exposure. The time of encoding is not known yet; it is set to that of
/// delivery.
inline void fill_header(std::span<const Frame> bracket, const DescriptorHeader& header, Descriptor& out) {
  const FrameInfo &first = bracket.front().info, &last = bracket.back().info;
  out.sequence = first.sequence / bracket.size();
  out.time.mid_exposure = first.mid_exposure + Duration{(last.mid_exposure - first.mid_exposure).ns / 2};
  out.time.delivered_after = last.delivered - out.time.mid_exposure;
  out.time.encoded_after = out.time.delivered_after;
  out.units = header.units;
  out.probe_id = header.probe_id;
  out.calibration_id = header.calibration_id;
  out.setting = header.setting;
  out.T_probe_origin = {};
}

}  // namespace estimate
}  // namespace lightwell
