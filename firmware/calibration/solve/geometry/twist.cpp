#include "calibration/solve/geometry/twist.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace lightwell::calibration {
namespace {

constexpr double kMaxGap_s = 1;
constexpr std::size_t kMinPoints = 8;

/// Twist of T_after T_before^-1 over `seconds`.
Twist between(const Pose& before, const Pose& after, double seconds) {
  const Pose moved = compose(after, inverse(before));
  Quat q = moved.rotation;
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const double s = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
  const double angle = 2 * std::atan2(s, q.w), rate = (s > 0 ? angle / s : 2) / seconds;
  return {{q.x * rate, q.y * rate, q.z * rate}, moved.translation * (1 / seconds)};
}

}  // namespace

std::vector<std::optional<Twist>> twists_of(const BoardObservations& observations,
                                            std::span<const Pose> rig_from_world) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> time(rig_from_world.size(), kUnknown);
  std::vector<std::size_t> seen(rig_from_world.size());
  for (const Picture& p : observations.pictures) seen[static_cast<std::size_t>(p.capture)] += p.observations.size();
  // Exclude poses with too few observations.
  for (const Picture& p : observations.pictures)
    if (seen[static_cast<std::size_t>(p.capture)] >= kMinPoints) time[static_cast<std::size_t>(p.capture)] = p.time_s;
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < time.size(); ++i)
    if (std::isfinite(time[i])) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return time[a] < time[b]; });
  std::vector<std::optional<Twist>> out(rig_from_world.size());
  for (std::size_t k = 1; k + 1 < order.size(); ++k) {
    const std::size_t before = order[k - 1], at = order[k], after = order[k + 1];
    const double seconds = time[after] - time[before];
    if (!(time[at] > time[before]) || !(time[after] > time[at]) || seconds > 2 * kMaxGap_s) continue;
    out[at] = between(rig_from_world[before], rig_from_world[after], seconds);
  }
  return out;
}

}  // namespace lightwell::calibration
