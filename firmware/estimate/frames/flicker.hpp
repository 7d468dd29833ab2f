// Detects mains flicker: lamps on 50 Hz mains are modulated at 100 Hz, on 60 Hz mains at 120 Hz.
//
// Flicker is observable where parts of the data have different times:
//   rolling shutter   rows are exposed one after another, so that modulated light causes bands at a constant distance.
//                     The scene's pattern along the rows is unknown but static; the bands move, unless a whole number
//                     of periods passes from frame to frame.
//   varied exposures  an exposure of a whole number of periods averages the modulation out, a short one does not.
//
// Model. Light 1 + m sin(F t), F an angular frequency, integrated over an exposure e around the time t of a row, is
// modulated by m a(e) sin(F t) with a(e) = sin(F e / 2) / (F e / 2), which is 0 for a whole number of periods. The
// logarithm of the ratio of the rows of two frames does not depend on the scene; at the rows' times tau it is
//   d(tau) = parabola + Re(z exp(i F tau)),   z = A h,   h = a(e1) exp(i F t1) - a(e0) exp(i F t0)
// with the same unknown A = -i m exp(i phase) for all pairs of frames. The parabola absorbs lamps that are switched and
// slow changes. z is fitted to each pair by least squares, A to the last pairs with weights 1/variance of z, for mains
// frequencies within 0.4 Hz. Coherence is the share of sum |z|²/variance that A h explains: 1 for pure flicker. Pairs
// of unrelated changes exceed c with probability (1 - c)^(n-1) (a Beta distribution), because the phase of motion does
// not advance by F dt per frame.
//
// Unobservable flicker is not reported as absent. h is known; where it is near zero for a frequency, no frame could
// show it (30 frames/s at 120 Hz, 25 at 100 Hz, 20 at both; exposures of 10 ms at 100 Hz).
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "imaging/frame.hpp"

namespace lightwell::estimate {

/// Largest number of row groups in a profile.
inline constexpr std::size_t kMaxRowGroups = 256;

/// Mean radiance along the rows of one lens's image.
struct RowProfile {
  /// Mean radiance of each group of rows from the top: linear, divided by exposure and gain, in any constant unit.
  /// Zero, negative or NaN where a group is to be ignored: one of its pixels is saturated, or it is outside of the
  /// image circle, or nearly so.
  std::span<const float> radiance;
  int rows = 0;  ///< Height of the image.
  /// Rows per group; the last may have fewer. Bands of 100 Hz repeat every 10 ms / row_readout rows.
  int group_rows = 16;
};

/// Evidence of the last frames about one frequency.
struct FlickerEvidence {
  /// Flicker would be visible: enough pairs, rows over at least one period, |h| large enough.
  bool observable = false;
  double modulation = 0;           ///< m: amplitude relative to the mean, the largest of the lenses.
  double uncertainty = 0;          ///< Standard deviation of `modulation`, from the scatter of the pairs.
  double coherence = 0;            ///< 0 to 1.
  double coherence_threshold = 1;  ///< Coherence that unrelated changes exceed once in 1e8 frames; at least 0.5.
};

/// Not thread-safe. Allocates 70 KB when constructed and nothing later. About 15 µs per frame.
class FlickerDetector {
 public:
  FlickerDetector();

  /// Adds the next frame (of a bracket: each exposure, in order), its lenses always in the same order, and returns the
  /// new state. Frames with invalid profiles (no lens, too many groups, exposure not above zero) are ignored. Time that
  /// runs backwards, and changes of size or readout time, reset the detector.
  ///   hz100, hz120  modulation above five sigma and 0.4 %, coherence above its threshold (0.7 of it while the state is
  ///                 the same)
  ///   none          both frequencies are observable, with modulation plus three sigma below 2 %
  ///   unknown       otherwise; always for the first 8 pairs of frames. With a global shutter, flicker is only
  ///                 observable while exposures vary: with a constant exposure it looks like any slow change.
  Flicker add(const FrameInfo& info, std::span<const RowProfile> lenses);

  /// Last result of add().
  [[nodiscard]] Flicker state() const { return state_; }
  /// For hz100 or hz120; default values for other states.
  [[nodiscard]] FlickerEvidence evidence(Flicker frequency) const;
  void reset();

 private:
  static constexpr std::size_t kFrequencies = 2;
  static constexpr std::size_t kPairs = 32;
  /// Frequencies tried around the nominal one, which is the middle.
  static constexpr std::size_t kFrequencyOffsets = 9;

  /// Logarithms of a frame's profile.
  struct FrameProfile {
    double time_s = 0, exposure_s = 0;
    bool used = false;
    std::array<std::vector<float>, kMaxLenses> log;  ///< NaN where a group is ignored.
  };
  /// Fit to a lens, a frequency and a pair: z, its variance (infinite where unobservable), mean square residual of d.
  struct BandFit {
    std::complex<double> z;
    double variance = std::numeric_limits<double>::infinity(), residual_variance = variance;
  };
  struct Pair {
    double time_s = 0;                                              ///< Of the newer frame.
    std::array<std::array<double, 2>, kFrequencies> attenuation{};  ///< a(e) of the older and the newer frame.
    std::array<std::array<std::complex<double>, kFrequencyOffsets>, kFrequencies> h{};  ///< For each frequency offset.
    std::array<std::array<BandFit, kMaxLenses>, kFrequencies> bands;
  };
  /// Ring buffer of the last pairs.
  struct Series {
    std::array<Pair, kPairs> pairs;
    std::size_t count = 0, next = 0;
    void push(const Pair& pair);
  };
  struct Modulation;

  [[nodiscard]] bool usable(const FrameInfo& info, std::span<const RowProfile> lenses) const;
  void add_pair(const FrameProfile& older, const FrameProfile& newer, Series& into) const;
  [[nodiscard]] BandFit fit_bands(const FrameProfile& older, const FrameProfile& newer, std::size_t lens,
                                  std::size_t frequency) const;
  [[nodiscard]] BandFit fit_global(const FrameProfile& older, const FrameProfile& newer) const;
  [[nodiscard]] FlickerEvidence evaluate_frequency(const Series& series, std::size_t frequency) const;
  [[nodiscard]] Modulation fit_series(const Series& series, std::size_t frequency, std::size_t offset) const;
  [[nodiscard]] Flicker classify();

  void build_basis();

  /// Basis functions of the fit at one group: 1, x, x², cos, -sin.
  using Basis = std::array<double, 5>;
  std::array<std::vector<Basis>, kFrequencies> basis_;
  std::array<FrameProfile, kMaxBracket + 1> profiles_;
  std::size_t newest_ = 0;
  Series equal_pairs_, varied_pairs_;  ///< Pairs of equal and of different exposures.
  std::int64_t origin_ns_ = 0;
  bool started_ = false;
  double readout_s_ = 0;
  int rows_ = 0, group_rows_ = 0;
  std::size_t lenses_ = 0, groups_ = 0;
  std::array<FlickerEvidence, kFrequencies> evidence_{};
  Flicker state_ = Flicker::unknown;
};

}  // namespace lightwell::estimate
