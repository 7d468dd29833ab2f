#include "estimate/panorama/kernels/code_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::estimate {
namespace {

constexpr std::size_t kLength = CodeSegments::kLength;
constexpr int kFullScale = 65535;

struct Segment {
  int base = 0, rise = 0, bend = 0;
};

int value_at(const Segment& s, std::size_t t) {
  const auto i = static_cast<int>(t);
  // Right shifts of negative integers round down.
  return s.base + ((s.rise * i) >> 4) + ((s.bend * i * i) >> 9);
}

struct SegmentFit {
  Segment segment;
  double error = std::numeric_limits<double>::infinity();  ///< Largest absolute error.
};

/// The best base for a rise and a bend: the errors at its two extremes are equal, unless a value would leave the range.
SegmentFit with_best_base(Segment s, const double* linear) {
  double least = std::numeric_limits<double>::infinity(), largest = -least;
  int lowest = std::numeric_limits<int>::max(), highest = std::numeric_limits<int>::min();
  s.base = 0;
  for (std::size_t t = 0; t < kLength; ++t) {
    const int v = value_at(s, t);
    least = std::min(least, linear[t] - v);
    largest = std::max(largest, linear[t] - v);
    lowest = std::min(lowest, v);
    highest = std::max(highest, v);
  }
  if (highest - lowest > kFullScale) return {};
  s.base = std::clamp(static_cast<int>(std::lround((least + largest) / 2)), -lowest, kFullScale - highest);
  // A negative base does not fit into its type; monotonic curves do not need one.
  if (s.base < 0 || s.base > kFullScale) return {};
  return {s, std::max(largest - s.base, s.base - least)};
}

/// Least squares for the curvature and the slope, then the best integers nearby.
SegmentFit fit_segment(const double* linear) {
  // Discrete orthogonal polynomials on 16 points: u = t - 7.5 and u² - 21.25.
  double by_u = 0, by_u2 = 0, norm_u = 0, norm_u2 = 0;
  for (std::size_t t = 0; t < kLength; ++t) {
    const double u = static_cast<double>(t) - 7.5, u2 = u * u - 21.25;
    by_u += u * linear[t];
    by_u2 += u2 * linear[t];
    norm_u += u * u;
    norm_u2 += u2 * u2;
  }
  const double quadratic = by_u2 / norm_u2, slope = by_u / norm_u - 2 * 7.5 * quadratic;
  const double bend = 512 * quadratic, rise = 16 * slope;
  SegmentFit best;
  if (std::abs(bend) > 32000 || rise < 0 || rise > kFullScale - 16) return best;
  for (int b = -6; b <= 6; ++b) {
    for (int r = -6; r <= 6; ++r) {
      const int of_bend = static_cast<int>(std::lround(bend)) + b;
      // A change of the bend moves the slope in the middle by 15 b / 512.
      const int of_rise = static_cast<int>(std::lround(rise - 16 * 15 * b / 512.0)) + r;
      if (of_rise < 0) continue;
      const SegmentFit fit = with_best_base({0, of_rise, of_bend}, linear);
      if (fit.error < best.error) best = fit;
    }
  }
  return best;
}

std::optional<CodeSegments> fit_segments(const std::array<double, 256>& linear,
                                         const std::array<std::uint16_t, 256>& rounded) {
  CodeSegments out;
  std::array<double, kLength> errors{};
  for (std::size_t h = 0; h < kLength; ++h) {
    const SegmentFit fit = fit_segment(&linear[h * kLength]);
    out.base.set(h, fit.segment.base);
    out.rise.set(h, fit.segment.rise);
    out.bend.set(h, fit.segment.bend);
    errors[h] = fit.error;
  }
  const auto worst = std::max_element(errors.begin(), errors.end());
  *worst = 0;
  if (!std::all_of(errors.begin(), errors.end(), [](double e) { return e <= kMaxSegmentError; })) return std::nullopt;
  const auto h = static_cast<std::size_t>(worst - errors.begin());
  out.exact_segment = h;
  for (CodeSegments::Words* const words : {&out.base, &out.rise, &out.bend}) words->set(h, 0);
  for (std::size_t t = 0; t < kLength; ++t) out.exact.set(t, rounded[h * kLength + t]);
  return out;
}

}  // namespace

int CodeSegments::value(std::size_t code) const {
  const std::size_t h = code / kLength, t = code % kLength;
  return (h == exact_segment ? exact[t] : 0) + value_at({base[h], rise[h], static_cast<std::int16_t>(bend[h])}, t);
}

CodeTable::CodeTable(const std::array<double, 256>& linear) {
  std::array<double, 256> clamped{};
  // Error diffusion: the rounding error of one code is added to the next.
  double rounding_error = 0;
  for (std::size_t code = 0; code < clamped.size(); ++code) {
    clamped[code] = std::clamp(linear[code], 0.0, double{kFullScale});
    const long rounded = std::lround(clamped[code] + rounding_error);
    values_[code] = static_cast<std::uint16_t>(std::clamp(rounded, 0L, long{kFullScale}));
    rounding_error += clamped[code] - values_[code];
  }
  segments_ = fit_segments(clamped, values_);
  if (!segments_) return;
  for (std::size_t code = 0; code < values_.size(); ++code)
    values_[code] = static_cast<std::uint16_t>(segments_->value(code));
}

}  // namespace lightwell::estimate
