// Pauses between attempts to connect, whichever end makes them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include <lightwell/time.hpp>

namespace lightwell {

/// Doubles from `min` to `max`; each pause is 20 % shorter to 20 % longer at random, so that many
/// clients of a probe that restarts do not all come back at the same moment.
class Backoff {
 public:
  Backoff(Duration min, Duration max, std::uint32_t seed) : min_(min), max_(max), next_(min), random_(seed) {}

  [[nodiscard]] Duration next() {
    const double pause = static_cast<double>(next_.ns) * jitter_(random_);
    next_.ns = std::min(2 * next_.ns, max_.ns);
    return {static_cast<std::int64_t>(pause)};
  }

  /// After a success.
  void reset() { next_ = min_; }

 private:
  Duration min_, max_, next_;
  std::minstd_rand random_;
  std::uniform_real_distribution<double> jitter_{0.8, 1.2};
};

}  // namespace lightwell
