// Limit of a rate.
#pragma once

#include <algorithm>
#include <cstdint>

namespace lightwell {

/// Allows `per_second` events a second, and up to `burst` at once. One thread.
class TokenBucket {
 public:
  TokenBucket(double per_second, double burst) : per_second_(per_second), burst_(burst), left_(burst) {}

  /// Counts an event and returns true, or returns false if it is one too many. `now_ns` of any one clock, rising.
  [[nodiscard]] bool take(std::int64_t now_ns) {
    if (!available(now_ns)) return false;
    left_ -= 1;
    return true;
  }
  /// Whether take() would return true.
  [[nodiscard]] bool available(std::int64_t now_ns) {
    if (last_ns_ != 0) left_ = std::min(burst_, left_ + static_cast<double>(now_ns - last_ns_) * 1e-9 * per_second_);
    last_ns_ = now_ns;
    return left_ >= 1;
  }

 private:
  double per_second_, burst_, left_;
  std::int64_t last_ns_ = 0;  ///< 0: before the first event.
};

}  // namespace lightwell
