#include "camera/backends/v4l2/negotiation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

#include <lightwell/text.hpp>

#include "camera/backends/v4l2/formats.hpp"

namespace lightwell::v4l2 {
namespace {

constexpr double kMinRateFraction = 0.95;

/// Rank of a size: 0 for the wanted one, then larger ones by their excess, then the others by their deficit.
std::tuple<int, long> size_rank(const Mode& mode, const RequestedFormat& wanted) {
  if (mode.width == wanted.width && mode.height == wanted.height) return {0, 0};
  const long area = static_cast<long>(mode.width) * mode.height;
  if (mode.width >= wanted.width && mode.height >= wanted.height) return {1, area};
  return {2, -area};
}

Fraction interval_of(double rate) {
  constexpr double kFine = 1000;
  const auto denominator = static_cast<std::uint32_t>(std::lround(std::clamp(rate, 0.001, 100000.0) * kFine));
  return {static_cast<std::uint32_t>(kFine), std::max<std::uint32_t>(denominator, 1)};
}

Fraction nearest_interval(const Mode& mode, double rate) {
  if (mode.intervals.empty()) return {};
  const auto by_rate = [](const Fraction& a, const Fraction& b) { return a.rate() < b.rate(); };
  if (mode.any_between) {
    const auto [slowest, fastest] = std::ranges::minmax(mode.intervals, by_rate);
    if (rate <= slowest.rate()) return slowest;
    return rate >= fastest.rate() ? fastest : interval_of(rate);
  }
  // Ties: prefer the higher rate.
  return *std::ranges::min_element(mode.intervals, [rate](const Fraction& a, const Fraction& b) {
    const double off_a = std::abs(a.rate() - rate), off_b = std::abs(b.rate() - rate);
    return off_a != off_b ? off_a < off_b : a.rate() > b.rate();
  });
}

struct Rank {
  std::tuple<int, long> size;
  int too_slow = 0;
  std::ptrdiff_t preference = 0;
  double rate_off = 0;

  friend auto operator<=>(const Rank&, const Rank&) = default;
};

Status nothing_fits(std::span<const Mode> modes, const RequestedFormat& wanted) {
  std::set<std::string> offered;
  for (const Mode& mode : modes) offered.insert(fourcc_text(mode.fourcc));
  const std::string list = offered.empty() ? "nothing" : joined(offered);
  if (!wanted.format.empty())
    return {StatusCode::invalid_argument,
            "v4l2: format=" + wanted.format + " is not among what the camera offers: " + list};
  return {StatusCode::invalid_argument,
          "v4l2: the camera offers " + list + ", of which nothing can be read here (" + format_names() + " can)"};
}

}  // namespace

int nearest_in(const StepRange& range, int wanted) {
  if (range.max <= range.min || wanted <= range.min) return range.min;
  const int step = std::max(range.step, 1);
  const long above = std::min<long>(wanted, range.max) - static_cast<long>(range.min);
  long value = range.min + (above + step / 2) / step * step;
  if (value > range.max) value -= step;
  return static_cast<int>(value);
}

Result<SelectedMode> choose_mode(std::span<const Mode> modes, const RequestedFormat& wanted) {
  const Mode* best = nullptr;
  Rank best_rank;
  Fraction best_interval;
  for (const Mode& mode : modes) {
    const Encoding* const encoding = encoding_of(mode.fourcc);
    if (encoding == nullptr || (!wanted.format.empty() && encoding->name != wanted.format)) continue;
    const Fraction interval = nearest_interval(mode, wanted.rate);
    const double rate = interval.rate();
    // An unknown rate is assumed to be sufficient.
    const bool too_slow = rate > 0 && rate < kMinRateFraction * wanted.rate;
    const Rank rank{size_rank(mode, wanted), too_slow ? 1 : 0, encoding - encodings().data(),
                    rate > 0 ? std::abs(rate - wanted.rate) : 0};
    if (best != nullptr && !(rank < best_rank)) continue;
    best = &mode;
    best_rank = rank;
    best_interval = interval;
  }
  if (best == nullptr) return nothing_fits(modes, wanted);
  return SelectedMode{*best, best_interval};
}

}  // namespace lightwell::v4l2
