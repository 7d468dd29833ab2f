#include "estimate/frames/flicker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace lightwell::estimate {
namespace {

using Complex = std::complex<double>;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr std::array kHertz = {100.0, 120.0};
constexpr std::array kStates = {Flicker::hz100, Flicker::hz120};

// The mains frequency is stable to 0.2 Hz, the flicker frequency to 0.4 Hz; a step of 0.1 Hz suffices for kWindow_s.
constexpr double kFrequencyStep_hz = 0.1;
constexpr double kWindow_s = 2.5;
constexpr double kMinPairs = 8;
// Smallest mean a(e)² at which flicker is observable.
constexpr double kMinAttenuation2 = 0.01;
// Smallest |h|² / (a(e0)² + a(e1)²), which is at most 2. At 0.15, bands move by a tenth of their distance per frame.
constexpr double kMinObservability = 0.15;
// Probability of a false alarm per frame: 10 to the power of minus this.
constexpr double kFalseAlarmExponent = 8;
constexpr double kMinCoherence = 0.5;
// Factor of the threshold while the state is the same.
constexpr double kCoherenceHysteresis = 0.7;
constexpr double kMinCoherenceLead = 0.1;
constexpr double kDetectionSigmas = 5;
constexpr double kMinModulation = 0.004;
constexpr double kMaxModulationForNone = 0.02;
// Relative difference of the radiance of a row between exposures after the parabola, due to errors of the response.
constexpr double kResponseMismatch = 0.005;
// Standard deviation of the input's rounding.
constexpr double kRoundingSigma = 1e-4;
constexpr double kInfiniteVariance = std::numeric_limits<double>::infinity();
constexpr int kUnknowns = 5;

double sinc(double x) { return std::abs(x) < 1e-9 ? 1 : std::sin(x) / x; }

bool equal_exposures(double a, double b) { return std::abs(a - b) <= 0.02 * std::max(a, b); }

}  // namespace

/// Fit of the modulation at one frequency to a series of pairs.
struct FlickerDetector::Modulation {
  double explained = 0, total = 0;
  double modulation = 0, variance = 0;       ///< The largest of the lenses, each.
  double misfit = 0;                         ///< Mean square of the residuals along rows, converted to modulation².
  double observability = kInfiniteVariance;  ///< Mean |h|² / mean (a0² + a1²), the smallest of the lenses.
  double attenuation = kInfiniteVariance;    ///< Mean a², the smallest of the lenses.
  double pairs = kInfiniteVariance;          ///< Effective number, the smallest of the lenses.
  double degrees_of_freedom = 0;             ///< Complex observations minus complex parameters.

  [[nodiscard]] double coherence() const { return total > 0 ? explained / total : 0; }
  [[nodiscard]] bool observable() const {
    return pairs >= kMinPairs && attenuation >= kMinAttenuation2 && observability >= kMinObservability;
  }

  /// Adds a lens.
  void add(const Modulation& lens) {
    explained += lens.explained;
    total += lens.total;
    modulation = std::max(modulation, lens.modulation);
    variance = std::max(variance, lens.variance);
    misfit = std::max(misfit, lens.misfit);
    observability = std::min(observability, lens.observability);
    attenuation = std::min(attenuation, lens.attenuation);
    pairs = std::min(pairs, lens.pairs);
    degrees_of_freedom += lens.degrees_of_freedom;
  }
  /// Adds a lens in which flicker is not observable.
  void mark_unobservable() { observability = attenuation = pairs = 0; }
};

FlickerDetector::FlickerDetector() {
  for (FrameProfile& profile : profiles_)
    for (auto& lens : profile.log) lens.assign(kMaxRowGroups, 0);
  for (auto& table : basis_) table.resize(kMaxRowGroups);
}

void FlickerDetector::build_basis() {
  for (std::size_t f = 0; f < kFrequencies; ++f) {
    for (std::size_t g = 0; g < groups_; ++g) {
      const double begin = static_cast<double>(g) * group_rows_;
      const double end = std::min<double>(begin + group_rows_, rows_);
      // Offset of the group's middle from the middle row, to which mid_exposure refers.
      const double row = (begin + end - rows_) / 2;
      const double angle = kTwoPi * kHertz[f] * row * readout_s_, x = 2 * row / rows_;
      basis_[f][g] = {1, x, x * x, std::cos(angle), -std::sin(angle)};
    }
  }
}

void FlickerDetector::reset() {
  for (FrameProfile& profile : profiles_) profile.used = false;
  equal_pairs_.count = equal_pairs_.next = 0;
  varied_pairs_.count = varied_pairs_.next = 0;
  started_ = false;
  evidence_ = {};
  state_ = Flicker::unknown;
}

void FlickerDetector::Series::push(const Pair& pair) {
  pairs[next] = pair;
  next = (next + 1) % pairs.size();
  count = std::min(count + 1, pairs.size());
}

FlickerEvidence FlickerDetector::evidence(Flicker frequency) const {
  for (std::size_t f = 0; f < kFrequencies; ++f)
    if (kStates[f] == frequency) return evidence_[f];
  return {};
}

bool FlickerDetector::usable(const FrameInfo& info, std::span<const RowProfile> lenses) const {
  if (lenses.empty() || lenses.size() > kMaxLenses) return false;
  if (!(info.exposure_s > 0) || !std::isfinite(info.exposure_s) || info.row_readout.ns < 0) return false;
  const RowProfile& first = lenses.front();
  if (first.rows <= 0 || first.group_rows <= 0 || first.radiance.size() > kMaxRowGroups) return false;
  return std::all_of(lenses.begin(), lenses.end(), [&](const RowProfile& p) {
    return p.rows == first.rows && p.group_rows == first.group_rows && p.radiance.size() == first.radiance.size();
  });
}

Flicker FlickerDetector::add(const FrameInfo& info, std::span<const RowProfile> lenses) {
  if (!usable(info, lenses)) return state_;
  const RowProfile& first = lenses.front();
  const double readout_s = info.row_readout.seconds();
  const auto elapsed = [&](std::int64_t since) {
    return (static_cast<double>(info.mid_exposure.ns) - static_cast<double>(since)) * 1e-9;
  };
  if (started_) {
    const bool layout_changed = lenses.size() != lenses_ || first.radiance.size() != groups_ || first.rows != rows_ ||
                                first.group_rows != group_rows_ || readout_s != readout_s_;
    if (layout_changed || elapsed(origin_ns_) < profiles_[newest_].time_s) reset();
  }
  if (!started_) {
    started_ = true;
    origin_ns_ = info.mid_exposure.ns;
    readout_s_ = readout_s;
    rows_ = first.rows;
    group_rows_ = first.group_rows;
    lenses_ = lenses.size();
    groups_ = first.radiance.size();
    build_basis();
  }

  const FrameProfile& previous = profiles_[newest_];
  newest_ = (newest_ + 1) % profiles_.size();
  FrameProfile& now = profiles_[newest_];
  now.used = true;
  now.time_s = elapsed(origin_ns_);
  now.exposure_s = info.exposure_s;
  for (std::size_t l = 0; l < lenses_; ++l) {
    for (std::size_t g = 0; g < groups_; ++g) {
      const float v = lenses[l].radiance[g];
      now.log[l][g] = v > 0 && std::isfinite(v) ? std::log(v) : std::numeric_limits<float>::quiet_NaN();
    }
  }
  if (previous.used && !equal_exposures(previous.exposure_s, now.exposure_s)) add_pair(previous, now, varied_pairs_);
  for (std::size_t back = 1; back < profiles_.size(); ++back) {
    const FrameProfile& older = profiles_[(newest_ + profiles_.size() - back) % profiles_.size()];
    if (!older.used || !equal_exposures(older.exposure_s, now.exposure_s)) continue;
    add_pair(older, now, equal_pairs_);
    break;
  }
  return state_ = classify();
}

void FlickerDetector::add_pair(const FrameProfile& older, const FrameProfile& newer, Series& into) const {
  // Pairs of the same time contain no information; the scene may have changed between frames far apart.
  if (!(newer.time_s > older.time_s) || newer.time_s - older.time_s > kWindow_s / 4) return;
  Pair pair;
  pair.time_s = newer.time_s;
  for (std::size_t f = 0; f < kFrequencies; ++f) {
    // Attenuation of the modulation by the exposure and by the mean over a group of rows.
    const auto attenuation = [&](double exposure_s) {
      return sinc(kTwoPi / 2 * kHertz[f] * group_rows_ * readout_s_) * sinc(kTwoPi / 2 * kHertz[f] * exposure_s);
    };
    const double a0 = attenuation(older.exposure_s), a1 = attenuation(newer.exposure_s);
    pair.attenuation[f] = {a0, a1};
    for (std::size_t i = 0; i < kFrequencyOffsets; ++i) {
      const double hertz = kHertz[f] + (static_cast<double>(i) - (kFrequencyOffsets - 1) / 2.0) * kFrequencyStep_hz;
      pair.h[f][i] =
          a1 * std::polar(1.0, kTwoPi * hertz * newer.time_s) - a0 * std::polar(1.0, kTwoPi * hertz * older.time_s);
    }
    if (readout_s_ > 0)
      for (std::size_t l = 0; l < lenses_; ++l) pair.bands[f][l] = fit_bands(older, newer, l, f);
    else
      pair.bands[f][0] = fit_global(older, newer);
  }
  into.push(pair);
}

/// Least-squares fit of a parabola and a sinusoid to the logarithm of the ratio along the rows.
FlickerDetector::BandFit FlickerDetector::fit_bands(const FrameProfile& older, const FrameProfile& newer,
                                                    std::size_t lens, std::size_t frequency) const {
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  Eigen::Matrix<double, kUnknowns, kUnknowns> normal = Eigen::Matrix<double, kUnknowns, kUnknowns>::Zero();
  Vector rhs = Vector::Zero();
  double squares = 0;
  std::size_t n = 0, first = 0, last = 0;
  for (std::size_t g = 0; g < groups_; ++g) {
    const double d = static_cast<double>(newer.log[lens][g]) - static_cast<double>(older.log[lens][g]);
    if (!std::isfinite(d)) continue;
    const Eigen::Map<const Vector> basis(basis_[frequency][g].data());
    normal.noalias() += basis * basis.transpose();
    rhs += basis * d;
    squares += d * d;
    if (n == 0) first = g;
    last = g;
    ++n;
  }
  const double covered_s = static_cast<double>(last - first + 1) * group_rows_ * readout_s_;
  if (n < 2 * kUnknowns || covered_s * kHertz[frequency] < 1) return {};
  const Eigen::LDLT<Eigen::Matrix<double, kUnknowns, kUnknowns>> solver(normal);
  const Vector fitted = solver.solve(rhs);
  const Eigen::Matrix<double, kUnknowns, kUnknowns> inverse =
      solver.solve(Eigen::Matrix<double, kUnknowns, kUnknowns>::Identity());
  const double residual_sum = std::max(0.0, squares - fitted.dot(rhs));
  const double residual_variance = residual_sum / static_cast<double>(n - kUnknowns) + kRoundingSigma * kRoundingSigma;
  const double variance = residual_variance * (inverse(3, 3) + inverse(4, 4));
  if (!std::isfinite(variance) || !(variance > 0)) return {};
  return {{fitted[3], fitted[4]}, variance, residual_variance};
}

/// Global shutter: the mean logarithm of the ratio over all rows, a real number.
FlickerDetector::BandFit FlickerDetector::fit_global(const FrameProfile& older, const FrameProfile& newer) const {
  double sum = 0, squares = 0;
  int n = 0;
  for (std::size_t l = 0; l < lenses_; ++l) {
    for (std::size_t g = 0; g < groups_; ++g) {
      const double d = static_cast<double>(newer.log[l][g]) - static_cast<double>(older.log[l][g]);
      if (!std::isfinite(d)) continue;
      sum += d;
      squares += d * d;
      ++n;
    }
  }
  if (n < 2) return {};
  const double mean = sum / n;
  const double residual_variance = std::max(0.0, squares / n - mean * mean) + kRoundingSigma * kRoundingSigma;
  return {{mean, 0}, residual_variance / n + kRoundingSigma * kRoundingSigma, residual_variance};
}

FlickerDetector::Modulation FlickerDetector::fit_series(const Series& series, std::size_t frequency,
                                                        std::size_t offset) const {
  const bool rolling_shutter = readout_s_ > 0;
  const double now_s = profiles_[newest_].time_s;

  Modulation all;
  for (std::size_t l = 0; l < (rolling_shutter ? lenses_ : 1); ++l) {
    const auto each = [&](auto&& f) {
      for (std::size_t i = 0; i < series.count; ++i) {
        const Pair& p = series.pairs[i];
        const BandFit& b = p.bands[frequency][l];
        if (b.variance < kInfiniteVariance && now_s - p.time_s <= kWindow_s) f(p, b);
      }
    };
    // Limits each weight to that of a typical pair (geometric mean), so that a few good fits do not dominate.
    double typical = 0, residual_variance = 0;
    int n = 0;
    each([&](const Pair&, const BandFit& b) {
      typical += std::log(b.variance);
      residual_variance += std::log(b.residual_variance);
      ++n;
    });
    if (n < 3) {
      all.mark_unobservable();
      continue;
    }
    typical = std::exp(typical / n);

    double weight = 0, hh = 0, hhhh = 0, zz = 0, aa = 0, least = kInfiniteVariance, most = 0;
    Complex hz = 0, sum_h2 = 0;
    each([&](const Pair& p, const BandFit& b) {
      const auto [a0, a1] = p.attenuation[frequency];
      const Complex h = p.h[frequency][offset];
      const double w = 1 / std::max(b.variance, typical), h2 = std::norm(h);
      weight += w;
      hh += w * h2;
      hhhh += w * h2 * w * h2;
      hz += w * std::conj(h) * b.z;
      sum_h2 += w * h * h;
      zz += w * std::norm(b.z);
      aa += w * (a0 * a0 + a1 * a1);
      least = std::min({least, std::abs(a0), std::abs(a1)});
      most = std::max({most, std::abs(a0), std::abs(a1)});
    });
    // For real d = Re(A h), with S = sum w h², N = sum w |h|², T = sum w conj(h) d, the normal equations are
    // N A + conj(S) conj(A) = 2 T; the information matrix of A has the eigenvalues (N ± |S|) / 2.
    const double min_information = rolling_shutter ? hh : (hh - std::abs(sum_h2)) / 2;
    const bool varied = rolling_shutter || most - least > 0.5;
    if (!(min_information > 1e-9 * hh) || !(aa > 0) || !varied) {
      all.mark_unobservable();
      continue;
    }
    const Complex amplitude =
        rolling_shutter ? hz / hh : 2.0 * (hh * hz - std::conj(sum_h2) * std::conj(hz)) / (hh * hh - std::norm(sum_h2));
    Modulation lens;
    lens.explained = (std::conj(hz) * amplitude).real();
    lens.total = zz;
    lens.modulation = std::abs(amplitude);
    // Each frame belongs to two pairs, so that its noise may count twice where bands alternate.
    lens.variance = 2 * std::max(1.0, (zz - lens.explained) / (rolling_shutter ? n - 1 : n - 2)) / min_information;
    lens.misfit = std::exp(residual_variance / n) * weight / min_information;
    lens.observability = (rolling_shutter ? 1 : 2) * min_information / aa;
    lens.attenuation = aa / (2 * weight);
    lens.pairs = hh * hh / hhhh;
    lens.degrees_of_freedom = rolling_shutter ? lens.pairs - 1 : lens.pairs / 2 - 1;
    all.add(lens);
  }
  return all;
}

FlickerEvidence FlickerDetector::evaluate_frequency(const Series& series, std::size_t frequency) const {
  const Modulation exact = fit_series(series, frequency, kFrequencyOffsets / 2);
  if (!exact.observable()) return {};
  Modulation best = exact;
  for (std::size_t i = 0; i < kFrequencyOffsets; ++i)
    if (const Modulation s = fit_series(series, frequency, i); s.coherence() > best.coherence()) best = s;
  FlickerEvidence out;
  out.observable = true;
  out.modulation = best.modulation;
  out.coherence = best.coherence();
  // Errors of the response are the same in all pairs of two exposures; residuals along rows indicate them.
  const double systematic =
      &series == &varied_pairs_ ? kResponseMismatch * kResponseMismatch / best.observability + best.misfit : 0;
  out.uncertainty = std::sqrt(best.variance + systematic);
  const double chance_coherence = 1 - std::pow(10, -kFalseAlarmExponent / std::max(best.degrees_of_freedom, 1.0));
  out.coherence_threshold = std::max(kMinCoherence, chance_coherence);
  return out;
}

Flicker FlickerDetector::classify() {
  std::array<bool, kFrequencies> found{}, absent{};
  for (std::size_t f = 0; f < kFrequencies; ++f) {
    FlickerEvidence& e = evidence_[f];
    e = evaluate_frequency(equal_pairs_, f);
    if (!e.observable && readout_s_ > 0)
      if (const FlickerEvidence varied = evaluate_frequency(varied_pairs_, f); varied.observable) e = varied;
    if (!e.observable) continue;
    const double enough = e.coherence_threshold * (state_ == kStates[f] ? kCoherenceHysteresis : 1);
    found[f] = e.coherence >= enough && e.modulation > std::max(kDetectionSigmas * e.uncertainty, kMinModulation);
    absent[f] = e.modulation + 3 * e.uncertainty < kMaxModulationForNone;
  }
  if (found[0] || found[1]) {
    // With few frames, modulation at one frequency leaks into the other: one coherence must clearly exceed the other.
    const std::size_t better = evidence_[1].coherence > evidence_[0].coherence ? 1 : 0;
    const bool decisive = evidence_[better].coherence > evidence_[1 - better].coherence + kMinCoherenceLead;
    return found[better] && decisive ? kStates[better] : Flicker::unknown;
  }
  return absent[0] && absent[1] ? Flicker::none : Flicker::unknown;
}

}  // namespace lightwell::estimate
