#include "estimate/common/flicker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>

namespace lightwell::estimate {
namespace {

using Complex = std::complex<double>;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr std::array kHertz = {100.0, 120.0};
constexpr std::array kStates = {Flicker::hz100, Flicker::hz120};

// The mains keep their frequency to 0.2 Hz, their flicker to twice that; within kSpan_s a step of 0.1 Hz is enough.
constexpr double kDriftStepHz = 0.1;
constexpr double kSpan_s = 2.5;
constexpr double kMinPairs = 8;
// What exposures leave of the swing, squared: less is hidden.
constexpr double kMinAttenuation2 = 0.01;
// |h|² relative to the squares of what both exposures see is up to 2; 0.15 is bands that move by a tenth of their
// distance. Slower ones could be the scene's.
constexpr double kReach = 0.15;
// How seldom chance may be so coherent, as a power of ten, a frame.
constexpr double kFalseAlarmExponent = 8;
constexpr double kMinCoherence = 0.5;
// Of the coherence that it takes to say so first.
constexpr double kCoherenceHysteresis = 0.7;
constexpr double kClearly = 0.1;
constexpr double kDeviations = 5;
constexpr double kMinModulation = 0.004;
constexpr double kMaxModulationForNone = 0.02;
// How well the radiance of one row by two exposures agrees, after the parabola: responses are not known better.
constexpr double kMismatch = 0.005;
// Rounding of what comes in.
constexpr double kFloor = 1e-4;
constexpr double kInfiniteVariance = std::numeric_limits<double>::infinity();
constexpr int kUnknowns = 5;

double sinc(double x) { return std::abs(x) < 1e-9 ? 1 : std::sin(x) / x; }

bool equal_exposures(double a, double b) { return std::abs(a - b) <= 0.02 * std::max(a, b); }

}  // namespace

/// The fit of one frequency to a series.
struct FlickerDetector::Modulation {
  double explained = 0, total = 0;
  double modulation = 0, variance = 0;  ///< Of the lens that swings most; of the lens that knows least.
  double misfit = 0;        ///< Mean square along the rows of what bands do not explain, as if bands had made it.
  double reach = kInfiniteVariance;  ///< Mean |h|² of the mean seen², of the lens where it is least.
  double attenuation = kInfiniteVariance;   ///< Mean a², likewise.
  double pairs = kInfiniteVariance;  ///< How many count, where they are fewest.
  double freedom = 0;       ///< Numbers of the pairs, two to a number, less those fitted.

  [[nodiscard]] double coherence() const { return total > 0 ? explained / total : 0; }
  [[nodiscard]] bool observable() const { return pairs >= kMinPairs && attenuation >= kMinAttenuation2 && reach >= kReach; }

  /// One lens more.
  void add(const Modulation& lens) {
    explained += lens.explained;
    total += lens.total;
    modulation = std::max(modulation, lens.modulation);
    variance = std::max(variance, lens.variance);
    misfit = std::max(misfit, lens.misfit);
    reach = std::min(reach, lens.reach);
    attenuation = std::min(attenuation, lens.attenuation);
    pairs = std::min(pairs, lens.pairs);
    freedom += lens.freedom;
  }
  /// One that shows nothing.
  void mark_unobservable() { reach = attenuation = pairs = 0; }
};

FlickerDetector::FlickerDetector() {
  for (FrameProfile& k : profiles_)
    for (auto& lens : k.log) lens.assign(kMaxRowGroups, 0);
  for (auto& table : basis_) table.resize(kMaxRowGroups);
}

void FlickerDetector::build_basis() {
  for (std::size_t f = 0; f < kFrequencies; ++f) {
    for (std::size_t g = 0; g < groups_; ++g) {
      const double begin = static_cast<double>(g) * group_rows_;
      const double end = std::min<double>(begin + group_rows_, rows_);
      // Rows are numbered by their middles, 0 to rows - 1; mid-exposure is of the middle of all.
      const double row = (begin + end - rows_) / 2;
      const double angle = kTwoPi * kHertz[f] * row * readout_s_, x = 2 * row / rows_;
      basis_[f][g] = {1, x, x * x, std::cos(angle), -std::sin(angle)};
    }
  }
}

void FlickerDetector::reset() {
  for (FrameProfile& k : profiles_) k.used = false;
  same_.count = same_.next = 0;
  varied_.count = varied_.next = 0;
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
    const bool other = lenses.size() != lenses_ || first.radiance.size() != groups_ || first.rows != rows_ ||
                       first.group_rows != group_rows_ || readout_s != readout_s_;
    if (other || elapsed(origin_ns_) < profiles_[newest_].time_s) reset();
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

  const FrameProfile& before = profiles_[newest_];
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
  if (before.used && !equal_exposures(before.exposure_s, now.exposure_s)) add_pair(before, now, varied_);
  for (std::size_t back = 1; back < profiles_.size(); ++back) {
    const FrameProfile& older = profiles_[(newest_ + profiles_.size() - back) % profiles_.size()];
    if (!older.used || !equal_exposures(older.exposure_s, now.exposure_s)) continue;
    add_pair(older, now, same_);
    break;
  }
  return state_ = classify();
}

void FlickerDetector::add_pair(const FrameProfile& older, const FrameProfile& newer, Series& into) const {
  // Frames of the same instant tell nothing, and frames long apart have different scenes.
  if (!(newer.time_s > older.time_s) || newer.time_s - older.time_s > kSpan_s / 4) return;
  Pair pair;
  pair.time_s = newer.time_s;
  for (std::size_t f = 0; f < kFrequencies; ++f) {
    // How much of the swing is left after an exposure, and after the mean over a group of rows.
    const auto attenuation = [&](double exposure_s) {
      return sinc(kTwoPi / 2 * kHertz[f] * group_rows_ * readout_s_) * sinc(kTwoPi / 2 * kHertz[f] * exposure_s);
    };
    const double a0 = attenuation(older.exposure_s), a1 = attenuation(newer.exposure_s);
    pair.attenuation[f] = {a0, a1};
    for (std::size_t i = 0; i < kDrifts; ++i) {
      const double hertz = kHertz[f] + (static_cast<double>(i) - (kDrifts - 1) / 2.0) * kDriftStepHz;
      pair.h[f][i] =
          a1 * std::polar(1.0, kTwoPi * hertz * newer.time_s) - a0 * std::polar(1.0, kTwoPi * hertz * older.time_s);
    }
    for (std::size_t l = 0; l < kMaxLenses; ++l) {
      if (readout_s_ > 0)
        pair.bands[f][l] = l < lenses_ ? rolling(older, newer, l, f) : BandFit{0, kInfiniteVariance, kInfiniteVariance};
      else
        pair.bands[f][l] = l == 0 ? global(older, newer) : BandFit{0, kInfiniteVariance, kInfiniteVariance};
    }
  }
  into.push(pair);
}

/// Least squares of a parabola and a sinusoid to the logarithm of the ratio along the rows.
FlickerDetector::BandFit FlickerDetector::rolling(const FrameProfile& older, const FrameProfile& newer, std::size_t lens,
                                                std::size_t frequency) const {
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  Eigen::Matrix<double, kUnknowns, kUnknowns> normal = Eigen::Matrix<double, kUnknowns, kUnknowns>::Zero();
  Vector right = Vector::Zero();
  double squares = 0;
  std::size_t n = 0, first = 0, last = 0;
  for (std::size_t g = 0; g < groups_; ++g) {
    const double d = static_cast<double>(newer.log[lens][g]) - static_cast<double>(older.log[lens][g]);
    if (!std::isfinite(d)) continue;
    const Eigen::Map<const Vector> basis(basis_[frequency][g].data());
    normal.noalias() += basis * basis.transpose();
    right += basis * d;
    squares += d * d;
    if (n == 0) first = g;
    last = g;
    ++n;
  }
  const double covered_s = static_cast<double>(last - first + 1) * group_rows_ * readout_s_;
  if (n < 2 * kUnknowns || covered_s * kHertz[frequency] < 1) return {0, kInfiniteVariance, kInfiniteVariance};
  const Eigen::LDLT<Eigen::Matrix<double, kUnknowns, kUnknowns>> solver(normal);
  const Vector fitted = solver.solve(right);
  const Eigen::Matrix<double, kUnknowns, kUnknowns> inverse =
      solver.solve(Eigen::Matrix<double, kUnknowns, kUnknowns>::Identity());
  const double left = std::max(0.0, squares - fitted.dot(right));
  const double residual_variance = left / static_cast<double>(n - kUnknowns) + kFloor * kFloor;
  const double variance = residual_variance * (inverse(3, 3) + inverse(4, 4));
  if (!std::isfinite(variance) || !(variance > 0)) return {0, kInfiniteVariance, kInfiniteVariance};
  return {{fitted[3], fitted[4]}, variance, residual_variance};
}

/// All rows at once: the mean logarithm of the ratio, a real number.
FlickerDetector::BandFit FlickerDetector::global(const FrameProfile& older, const FrameProfile& newer) const {
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
  if (n < 2) return {0, kInfiniteVariance, kInfiniteVariance};
  const double mean = sum / n;
  const double residual_variance = std::max(0.0, squares / n - mean * mean) + kFloor * kFloor;
  return {{mean, 0}, residual_variance / n + kFloor * kFloor, residual_variance};
}

FlickerDetector::Modulation FlickerDetector::fit(const Series& series, std::size_t frequency, std::size_t drift) const {
  const bool rolls = readout_s_ > 0;
  const double now_s = profiles_[newest_].time_s;

  Modulation all;
  for (std::size_t l = 0; l < (rolls ? lenses_ : 1); ++l) {
    const auto each = [&](auto&& f) {
      for (std::size_t i = 0; i < series.count; ++i) {
        const Pair& p = series.pairs[i];
        const BandFit& b = p.bands[frequency][l];
        if (b.variance < kInfiniteVariance && now_s - p.time_s <= kSpan_s) f(p, b);
      }
    };
    // No pair counts more than a typical one, however well it fits: a few that happen to are no crowd of witnesses.
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
    Complex hz = 0, turned = 0;
    each([&](const Pair& p, const BandFit& b) {
      const auto [a0, a1] = p.attenuation[frequency];
      const Complex h = p.h[frequency][drift];
      const double w = 1 / std::max(b.variance, typical), h2 = std::norm(h);
      weight += w;
      hh += w * h2;
      hhhh += w * h2 * w * h2;
      hz += w * std::conj(h) * b.z;
      turned += w * h * h;
      zz += w * std::norm(b.z);
      aa += w * (a0 * a0 + a1 * a1);
      least = std::min({least, std::abs(a0), std::abs(a1)});
      most = std::max({most, std::abs(a0), std::abs(a1)});
    });
    // Real d = Re(A h): with S = sum w h², N = sum w |h|², T = sum w conj(h) d the normal equations are
    // N A + conj(S) conj(A) = 2 T; what A says of its squares has the eigenvalues (N ± |S|) / 2.
    const double weakest = rolls ? hh : (hh - std::abs(turned)) / 2;
    const bool varied = rolls || most - least > 0.5;
    if (!(weakest > 1e-9 * hh) || !(aa > 0) || !varied) {
      all.mark_unobservable();
      continue;
    }
    const Complex amplitude =
        rolls ? hz / hh : 2.0 * (hh * hz - std::conj(turned) * std::conj(hz)) / (hh * hh - std::norm(turned));
    Modulation one;
    one.explained = (std::conj(hz) * amplitude).real();
    one.total = zz;
    one.modulation = std::abs(amplitude);
    // A frame is in two pairs: its noise counts up to twice where the bands alternate.
    one.variance = 2 * std::max(1.0, (zz - one.explained) / (rolls ? n - 1 : n - 2)) / weakest;
    one.misfit = std::exp(residual_variance / n) * weight / weakest;
    one.reach = (rolls ? 1 : 2) * weakest / aa;
    one.attenuation = aa / (2 * weight);
    one.pairs = hh * hh / hhhh;
    one.freedom = rolls ? one.pairs - 1 : one.pairs / 2 - 1;
    all.add(one);
  }
  return all;
}

FlickerEvidence FlickerDetector::evaluate_frequency(const Series& series, std::size_t frequency) const {
  const Modulation exact = fit(series, frequency, kDrifts / 2);
  if (!exact.observable()) return {};
  Modulation best = exact;
  for (std::size_t i = 0; i < kDrifts; ++i)
    if (const Modulation s = fit(series, frequency, i); s.coherence() > best.coherence()) best = s;
  FlickerEvidence out;
  out.observable = true;
  out.modulation = best.modulation;
  out.coherence = best.coherence();
  // A response that is known badly errs alike in all pairs of two exposures; rows that do not look like bands show it.
  const double alike = &series == &varied_ ? kMismatch * kMismatch / best.reach + best.misfit : 0;
  out.uncertainty = std::sqrt(best.variance + alike);
  const double chance = 1 - std::pow(10, -kFalseAlarmExponent / std::max(best.freedom, 1.0));
  out.coherence_threshold = std::max(kMinCoherence, chance);
  return out;
}

Flicker FlickerDetector::classify() {
  std::array<bool, kFrequencies> found{}, absent{};
  for (std::size_t f = 0; f < kFrequencies; ++f) {
    FlickerEvidence& e = evidence_[f];
    e = evaluate_frequency(same_, f);
    if (!e.observable && readout_s_ > 0)
      if (const FlickerEvidence varied = evaluate_frequency(varied_, f); varied.observable) e = varied;
    if (!e.observable) continue;
    const double enough = e.coherence_threshold * (state_ == kStates[f] ? kCoherenceHysteresis : 1);
    found[f] = e.coherence >= enough && e.modulation > std::max(kDeviations * e.uncertainty, kMinModulation);
    absent[f] = e.modulation + 3 * e.uncertainty < kMaxModulationForNone;
  }
  if (found[0] || found[1]) {
    // One lamp leaks into the other's frequency where frames are few: the better explanation must be clearly better.
    const std::size_t better = evidence_[1].coherence > evidence_[0].coherence ? 1 : 0;
    const bool clear = evidence_[better].coherence > evidence_[1 - better].coherence + kClearly;
    return found[better] && clear ? kStates[better] : Flicker::unknown;
  }
  return absent[0] && absent[1] ? Flicker::none : Flicker::unknown;
}

}  // namespace lightwell::estimate
