// Does the light flicker with the mains? Lamps on 50 Hz swing at 100 Hz, on 60 Hz at 120 Hz.
//
// What shows it is time that differs within what the camera sees:
//   rolling shutter   rows are exposed one after another, so light that swings paints bands across the picture, always
//                     as many rows apart. The scene's own pattern along the rows is unknown but stands still; the
//                     bands do not, unless a whole number of periods passes from frame to frame.
//   varied exposures  an exposure of a whole number of periods averages the swing away, a short one catches it.
//
// Model. Light 1 + m sin(F t) through an exposure e around the instant t of a row swings by m a(e) sin(F t), with
// a(e) = sin(F e / 2) / (F e / 2) (the integral of a sinusoid; 0 for a whole number of periods). Of two frames, the
// logarithm of the ratio of their rows is free of the scene; along the rows' own times tau it is
//   d(tau) = parabola + Re(z exp(i F tau)),   z = A h,   h = a(e1) exp(i F t1) - a(e0) exp(i F t0)
// with one unknown A = -i m exp(i phase) for all pairs of frames. The parabola takes up lamps that switch and light
// that drifts. z is fitted to each pair (least squares), A to the last pairs by weights 1/variance of z, for F within
// 0.4 Hz. Coherence, the share of sum |z|²/variance that A h explains, is 1 for flicker alone; pairs of unrelated
// changes reach c with probability (1 - c)^(n-1) (a Beta distribution): motion has no reason to turn its phase by F dt
// each frame.
//
// What cannot be seen is not denied. h is known: where it is near zero for the frequency in question (30 frames/s and
// 120 Hz, 25 and 100, 20 and both; exposures of 10 ms and 100 Hz) no frame could tell. At each of the usual
// rates (15, 20, 24, 25, 30, 50, 60) one of the two frequencies or both stand still; 27 frames/s shows both.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>

#include "camera/frame.hpp"

namespace lightwell::estimate {

/// Groups of rows that a profile may have.
inline constexpr std::size_t kMaxRowGroups = 256;

/// Light along the rows of one lens's picture.
struct RowProfile {
  /// Mean radiance of each group of rows from the top: linear, divided by exposure and gain, any unit that stays. Zero,
  /// negative or NaN where the group says nothing: a pixel of it was saturated, or it sees nothing, or next to nothing.
  std::span<const float> radiance;
  int rows = 0;         ///< Of the picture.
  int group_rows = 16;  ///< The last may have fewer. Bands of 100 Hz are 10 ms / row_readout rows long.
};

/// What the last frames say about one frequency.
struct FlickerEvidence {
  /// The frames would have shown it: enough pairs, rows over at least one period, |h| large enough.
  bool observable = false;
  double modulation = 0;   ///< m: amplitude of the swing relative to the mean, the largest of the lenses.
  double uncertainty = 0;  ///< One deviation of it, from the scatter of the pairs of frames.
  double coherence = 0;    ///< 0 to 1.
  double coherence_threshold = 1;       ///< Coherence that chance reaches once in 1e8 frames, at least 0.5.
};

/// One thread; takes its memory when it is made (70 KB) and none later. About 15 µs a frame.
class FlickerDetector {
 public:
  FlickerDetector();

  /// The next frame (of a bracket: each exposure, in order), its lenses in the same order each time. Frames whose
  /// profiles do not fit the class (no lens, too many groups, exposure not above zero) are left out. Time that runs
  /// backwards, other sizes or another readout start anew.
  ///   hz100, hz120  bands of more than five deviations and 0.4 %, as coherent as needed (0.7 of that once it is said)
  ///   none          both frequencies are visible, and swing by less than 2 % with three deviations to spare
  ///   unknown       all else; always for the first 8 pairs of frames. A global shutter can tell only while exposures
  ///                 are varied: of one exposure, mains flicker looks like any slow change.
  Flicker add(const FrameInfo& info, std::span<const RowProfile> lenses);

  /// What add() last gave.
  [[nodiscard]] Flicker state() const { return state_; }
  /// Of 100 Hz or of 120 Hz; nothing for the other values.
  [[nodiscard]] FlickerEvidence evidence(Flicker frequency) const;
  void reset();

 private:
  static constexpr std::size_t kFrequencies = 2;
  static constexpr std::size_t kPairs = 32;
  static constexpr std::size_t kDrifts = 9;  ///< Frequencies tried around each; the middle one is exact.

  /// A frame's profile, logarithms.
  struct FrameProfile {
    double time_s = 0, exposure_s = 0;
    bool used = false;
    std::array<std::vector<float>, kMaxLenses> log;  ///< NaN where a group says nothing.
  };
  /// What one lens shows of one frequency in a pair of frames: z and its variance, infinite where nothing, and the mean
  /// square of d that the fit leaves.
  struct BandFit {
    std::complex<double> z;
    double variance = 0, residual_variance = 0;
  };
  struct Pair {
    double time_s = 0;                                                        ///< Of the newer frame.
    std::array<std::array<double, 2>, kFrequencies> attenuation{};                   ///< a of the older and the newer one.
    std::array<std::array<std::complex<double>, kDrifts>, kFrequencies> h{};  ///< At the frequencies tried.
    std::array<std::array<BandFit, kMaxLenses>, kFrequencies> bands;
  };
  /// The last pairs.
  struct Series {
    std::array<Pair, kPairs> pairs;
    std::size_t count = 0, next = 0;
    void push(const Pair& pair);
  };
  struct Modulation;

  [[nodiscard]] bool usable(const FrameInfo& info, std::span<const RowProfile> lenses) const;
  void add_pair(const FrameProfile& older, const FrameProfile& newer, Series& into) const;
  [[nodiscard]] BandFit rolling(const FrameProfile& older, const FrameProfile& newer, std::size_t lens, std::size_t frequency) const;
  [[nodiscard]] BandFit global(const FrameProfile& older, const FrameProfile& newer) const;
  [[nodiscard]] FlickerEvidence evaluate_frequency(const Series& series, std::size_t frequency) const;
  [[nodiscard]] Modulation fit(const Series& series, std::size_t frequency, std::size_t drift) const;
  [[nodiscard]] Flicker classify();

  void build_basis();

  /// 1, x, x², cos, -sin of each group.
  using Basis = std::array<double, 5>;
  std::array<std::vector<Basis>, kFrequencies> basis_;
  std::array<FrameProfile, kMaxBracket + 1> profiles_;
  std::size_t newest_ = 0;
  Series same_, varied_;  ///< Pairs of equal and of different exposures.
  std::int64_t origin_ns_ = 0;
  bool started_ = false;
  double readout_s_ = 0;
  int rows_ = 0, group_rows_ = 0;
  std::size_t lenses_ = 0, groups_ = 0;
  std::array<FlickerEvidence, kFrequencies> evidence_{};
  Flicker state_ = Flicker::unknown;
};

}  // namespace lightwell::estimate
