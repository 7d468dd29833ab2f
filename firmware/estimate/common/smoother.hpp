// Smooths light from frame to frame: still light loses its noise, light that changes comes through at once.
//
// One gain a frame, for all coefficients alike: with r the frame's projection and p the smoothed one,
//   p += a (r - p),  0 < a <= 1.
// p is therefore always a weighted mean of frames that came in, with weights that sum to one: constant light stays
// exactly as it is, and nothing can decay or build up, however long it runs.
//
// The gain is the larger of three:
//   Kalman      V / (V + n²)        n: RMS irradiance of this frame's noise; V: of what is left in p, for which
//                                   V' = (1-a)² V + a² n² (Kalman 1960). After a change this is the plain mean of the
//                                   frames since, and a noisier frame weighs less.
//   time        1 - exp(-dt / tau)  the low-pass at rest of the 1 euro filter (Casiez et al. 2012, eq. 3 to 5)
//   change      0 up to c = 2.5, then linearly to 1 at c = 4, of the surprise c = |r - p| / sqrt(V + n²)
// Where the 1 euro filter opens with speed times a constant that somebody has to tune, this one opens with the change
// relative to the noise, which is known. |r - p| is the larger of its RMS irradiance and of its RMS over the
// coefficients of bands 0 to 6, scaled so that both are n for noise that is white over directions: reflections see
// changes that irradiance hardly feels. A lamp that switches in the middle of an exposure is complete one frame later:
// after a change that passed, the next frame passes too.
//
// Lights. The projection is of everything, lights included, and what is sent beside the lights is p less their caps:
// the sum is p whatever the lights are. So that no cap takes out what p does not have, a light is the same kind of mean
// over the frames in which its track was seen without a break, and follows at once where it alone has changed: by more
// than 4 deviations of its direction, or by more light than 4 n (two lamps that merge or part change no coefficient).
// A new track starts as it is found. Hence p less caps differs from r less caps as found by no more than
// |r - p| and, a light, 4 n. A track that is gone is forgotten: what is left of it in p is no lamp any more.
#pragma once

#include <array>
#include <span>

#include <lightwell/descriptor.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/common/spectrum.hpp"

namespace lightwell::estimate {

/// Longer is less noise and more lag, s.
inline constexpr double kSmoothingTime = 0.25;

/// In the probe's frame, one thread, nothing allocated. With noise that is white and known, steps of dt:
///   noise   variance falls to (1 - q) / (1 + q), q = exp(-dt / tau): 1/15 at 30 frames/s
///   step    of more than 5 n is fully there in its own frame
///   ramp    lags by at most tau, and never by more than 4 sqrt(V + n²)
class Smoother {
 public:
  /// `time_constant_s`: tau. Zero, negative or NaN: every frame passes as it is.
  explicit Smoother(double time_constant_s = kSmoothingTime);

  /// Replaces the frame's projection and lights by the smoothed ones. Returns the RMS irradiance of what that left out,
  /// frame less smoothed.
  ///   noise_rms  of the irradiance, over normals, that the sensor's noise makes in this frame alone; same units as
  ///              `scene`. Zero, negative or not finite: nothing to smooth, this frame and the next pass as they are.
  ///   time       a step of zero counts as 1/30 s; time that runs backwards starts anew.
  /// Tracks are distinct; a light with track 0 and those beyond kMaxLights are left as they are. Coefficients that are
  /// not finite are replaced by the smoothed ones, or zero, such lights by darkness, and the answer is infinite.
  IrradianceRms apply(Projection& scene, std::span<Light> lights, ProbeTime time, double noise_rms);

  /// RMS irradiance of the noise that is left in what apply() last gave, sqrt(V). At most noise_rms.
  [[nodiscard]] double residual_noise() const;

  /// The next frame passes as it is: units or calibration have changed.
  void reset();

 private:
  struct SmoothedLight {
    std::uint32_t track = 0;
    Vec3d direction;
    std::array<double, 3> irradiance{};
    double angular_radius_rad = 0;
    double variance = 1;  ///< Of its noise, relative to that of one frame.
  };

  [[nodiscard]] double normalized_innovation(const Projection& difference, const IrradianceRms& rms) const;
  void smooth_lights(std::span<Light> lights, double gain, double slowest, double noise_rms);

  double tau_s_;
  double white_;  ///< RMS irradiance of coefficients that are all one.
  bool started_ = false;
  bool changed_ = false;  ///< The last frame passed because it was different.
  ProbeTime time_;
  double variance_ = 0;
  Projection smoothed_;
  std::array<SmoothedLight, kMaxLights> lights_{}, previous_lights_{};
  std::size_t light_count_ = 0;
};

}  // namespace lightwell::estimate
