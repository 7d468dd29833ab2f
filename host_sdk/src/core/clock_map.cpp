#include "core/clock_map.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::core {
namespace {

/// Of two round trips within this time the shorter is kept, so that kMaxRoundTrips of them reach back two minutes.
constexpr Duration kMinSpacing{4'000'000'000};
/// Tolerance for the rounding of vertices in double.
constexpr double kRounding_ns = 0.5;
/// 73 years: larger clock values are invalid, and their differences could overflow.
constexpr std::int64_t kFar = std::int64_t{1} << 61;

bool is_time(std::int64_t ns) { return ns >= -kFar && ns <= kFar; }

}  // namespace

void ClockMap::add(HostTime sent, ProbeTime probe, HostTime received) {
  if (!is_time(sent.ns) || !is_time(probe.ns) || !is_time(received.ns)) return;
  if (received < sent || (count_ > 0 && received < kept_[count_ - 1].at)) return;
  // Half of the difference, because the sum of two times can overflow.
  const std::int64_t half = (received.ns - sent.ns) / 2;
  const RoundTrip round_trip{received, {probe.ns - (sent.ns + half)}, half + 1};
  const auto drop = [&](std::size_t k) {
    std::move(kept_.begin() + static_cast<std::ptrdiff_t>(k) + 1, kept_.begin() + static_cast<std::ptrdiff_t>(count_),
              kept_.begin() + static_cast<std::ptrdiff_t>(k));
    --count_;
  };
  if (count_ >= 2 && kept_[count_ - 1].at - kept_[count_ - 2].at < kMinSpacing)
    drop(kept_[count_ - 1].half_ns < kept_[count_ - 2].half_ns ? count_ - 2 : count_ - 1);
  if (count_ == kMaxRoundTrips) drop(0);
  kept_[count_++] = round_trip;
  if (fit()) return;
  kept_[0] = round_trip;
  count_ = 1;
  (void)fit();
}

bool ClockMap::fit() {
  const RoundTrip& newest = kept_[count_ - 1];
  const auto h = static_cast<double>(newest.half_ns);
  corners_[0] = {-h, -kMaxDrift};
  corners_[1] = {h, -kMaxDrift};
  corners_[2] = {h, kMaxDrift};
  corners_[3] = {-h, kMaxDrift};
  corner_count_ = 4;
  // Clip by each half-plane (Sutherland & Hodgman 1974): sign (offset + drift t - seen) <= most.
  const auto clip = [&](double sign, double t, double seen, double most) {
    std::array<std::array<double, 2>, 2 * kMaxRoundTrips + 8> in = corners_;
    const std::size_t count = corner_count_;
    const auto beyond = [&](const std::array<double, 2>& p) { return sign * (p[0] + p[1] * t - seen) - most; };
    corner_count_ = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto &a = in[i], &b = in[(i + 1) % count];
      const double of_a = beyond(a), of_b = beyond(b);
      if (of_a <= kRounding_ns) corners_[corner_count_++] = a;
      if ((of_a <= kRounding_ns) != (of_b <= kRounding_ns) && of_a != of_b) {
        const double f = std::clamp(of_a / (of_a - of_b), 0.0, 1.0);
        corners_[corner_count_++] = {a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])};
      }
      if (corner_count_ + 2 > corners_.size()) break;
    }
  };
  for (std::size_t i = 0; i + 1 < count_ && corner_count_ > 0; ++i) {
    const RoundTrip& one = kept_[i];
    const auto t = static_cast<double>((one.at - newest.at).ns),
               seen = static_cast<double>((one.offset - newest.offset).ns);
    const double most = static_cast<double>(one.half_ns) + kMaxDriftChange * std::abs(t);
    clip(1, t, seen, most);
    if (corner_count_ > 0) clip(-1, t, seen, most);
  }
  if (corner_count_ == 0) return false;
  const auto [low, high] =
      std::minmax_element(corners_.begin(), corners_.begin() + static_cast<std::ptrdiff_t>(corner_count_),
                          [](const auto& a, const auto& b) { return a[1] < b[1]; });
  slowest_ = (*low)[1];
  fastest_ = (*high)[1];
  return true;
}

ClockMap::Range ClockMap::offsets(HostTime now) const {
  const auto t = static_cast<double>((now - kept_[count_ - 1].at).ns);
  Range out{INFINITY, -INFINITY};
  for (std::size_t i = 0; i < corner_count_; ++i) {
    const double offset = corners_[i][0] + corners_[i][1] * t;
    out.low = std::min(out.low, offset);
    out.high = std::max(out.high, offset);
  }
  out.low -= kMaxDriftChange * std::abs(t) + kRounding_ns;
  out.high += kMaxDriftChange * std::abs(t) + kRounding_ns;
  return out;
}

Duration ClockMap::offset(HostTime now) const {
  if (!known()) return {};
  const Range range = offsets(now);
  return kept_[count_ - 1].offset + Duration{static_cast<std::int64_t>(std::llround((range.low + range.high) / 2))};
}

Duration ClockMap::uncertainty(HostTime now) const {
  if (!known()) return {};
  const Range range = offsets(now);
  return {static_cast<std::int64_t>(std::ceil((range.high - range.low) / 2)) + 1};
}

HostTime ClockMap::to_host(ProbeTime time) const {
  if (!known()) return {time.ns};
  time.ns = std::clamp(time.ns, -kFar, kFar);
  // offset() needs the host time that is being computed; one iteration has a relative error of 100 ppm squared.
  const HostTime near{time.ns - kept_[count_ - 1].offset.ns};
  return {time.ns - offset(near).ns};
}

}  // namespace lightwell::core
