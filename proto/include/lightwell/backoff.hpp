// Exponential backoff with jitter between connection attempts.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include <lightwell/time.hpp>

namespace lightwell {

/// Pauses double from `min` to `max`, each with uniform jitter of +-20 %, so that the clients of a restarted probe do
/// not reconnect all at the same moment.
class Backoff {
 public:
  Backoff(Duration min, Duration max, std::uint32_t seed) : min_(min), max_(max), next_(min), random_(seed) {}

  [[nodiscard]] Duration next() {
    const double pause = static_cast<double>(next_.ns) * jitter_(random_);
    next_.ns = std::min(2 * next_.ns, max_.ns);
    return {static_cast<std::int64_t>(pause)};
  }

  /// Starts again at `min`, after a success.
  void reset() { next_ = min_; }

 private:
  Duration min_, max_, next_;
  std::minstd_rand random_;
  std::uniform_real_distribution<double> jitter_{0.8, 1.2};
};

}  // namespace lightwell
