// Temporal filter of projection and lights: removes noise from constant light, and passes changes without lag.
//
// One gain per frame for all coefficients: with r the frame's projection and p the smoothed one,
//   p += a (r - p),  0 < a <= 1.
// p is therefore a weighted mean of input frames with weights that sum to one: constant light is reproduced exactly,
// and rounding errors do not accumulate.
//
// The gain is the larger of three:
//   Kalman      V / (V + n²)        n: RMS irradiance of this frame's noise; V: variance of the noise in p, for which
//                                   V' = (1-a)² V + a² n² (Kalman 1960). After a change this gives the mean of the
//                                   frames since, with lower weights for noisier frames.
//   time        1 - exp(-dt / tau)  the low-pass at rest of the 1 euro filter (Casiez et al. 2012, eq. 3 to 5)
//   change      0 for c <= 2.5, then linear to 1 at c = 4; c = |r - p| / sqrt(V + n²), the normalized innovation
// The 1 euro filter increases its cutoff with speed times a constant that has to be tuned; this filter uses the change
// relative to the noise, which is known. |r - p| is the larger of its RMS irradiance and of its RMS over the
// coefficients of bands 0 to 6, scaled so that both equal n for noise that is white over directions: some changes
// affect reflections and hardly irradiance. After a change that passed unfiltered, the next frame passes, too, because
// a lamp that is switched during an exposure is complete one frame later.
//
// Lights. The projection includes the lights; a descriptor holds their caps and p minus the caps, so that the sum is p
// for any lights. So that no cap subtracts light that p does not contain, a light is the same kind of mean over the
// frames in which its track was found without a gap. It passes unfiltered where it alone has changed: by more than
// 4 sigma of its direction, or by an irradiance of more than 4 n (two lamps that merge or separate change no
// coefficient). A new track starts with its first value. Hence p minus smoothed caps differs from r minus the found
// caps by at most |r - p| plus 4 n per light. A lost track is dropped: its remainder in p is no longer a light.
#pragma once

#include <array>
#include <span>

#include <lightwell/descriptor.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// Default time constant, s: longer means less noise and more lag.
inline constexpr double kSmoothingTime = 0.25;

/// Works in the probe's frame; not thread-safe; allocates nothing. White noise of known variance falls by the factor
/// (1 - q) / (1 + q), q = exp(-dt / tau); a ramp lags by at most tau, and never by more than 4 sqrt(V + n²).
class Smoother {
 public:
  /// `time_constant_s`: tau. Zero, negative or NaN: every frame passes unchanged.
  explicit Smoother(double time_constant_s = kSmoothingTime);

  /// Replaces the frame's projection and lights by the smoothed ones. Returns the RMS irradiance of the difference
  /// (frame minus smoothed).
  ///   noise_rms  RMS over normals of the irradiance by the sensor's noise in this frame alone; units of `scene`. Where
  ///              it is zero, negative or not finite, this frame and the next pass unchanged.
  ///   time       mid-exposure; a step of zero counts as 1/30 s; time that runs backwards resets the filter.
  /// Tracks must be distinct; lights with track 0 and those beyond kMaxLights are left unchanged. Coefficients that are
  /// not finite are replaced by the smoothed ones (or zero), such lights by black ones; the result is then infinite.
  IrradianceRms apply(Projection& scene, std::span<Light> lights, ProbeTime time, double noise_rms);

  /// RMS irradiance of the noise in the last output of apply(), sqrt(V). At most noise_rms.
  [[nodiscard]] double residual_noise() const;

  /// Makes the next frame pass unchanged. For changes of units or calibration.
  void reset();

 private:
  struct SmoothedLight {
    std::uint32_t track = 0;
    Vec3d direction;
    std::array<double, 3> irradiance{};
    double angular_radius_rad = 0;
    double variance = 1;  ///< Of its noise, relative to that of a single frame.
  };

  [[nodiscard]] double normalized_innovation(const Projection& difference, const IrradianceRms& rms) const;
  void smooth_lights(std::span<Light> lights, double gain, double min_gain, double noise_rms);

  double tau_s_;
  double white_rms_;  ///< RMS irradiance of coefficients that are all 1.
  bool started_ = false;
  bool previous_frame_changed_ = false;  ///< The previous frame passed as a change.
  ProbeTime time_;
  double variance_ = 0;
  Projection smoothed_;
  std::array<SmoothedLight, kMaxLights> lights_{}, previous_lights_{};
  std::size_t light_count_ = 0;
};

}  // namespace lightwell::estimate
