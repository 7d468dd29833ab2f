// Long computations in steps: a limit of the elementary operations of a step. A count instead of a clock, so that a
// replay of the same frames gives the same answers on any machine.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

namespace lightwell::specular {

/// The unit is the multiplication of a coefficient of GlossOperator with its twelve values: 2 ns (x86-64, SSE2).
class WorkBudget {
 public:
  static constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

  explicit WorkBudget(std::size_t operations) : limit_(operations) {}

  /// Whether a part of the computation fits. The first part of a step always does, so that every step makes
  /// progress; a step exceeds the limit if its first part alone does.
  [[nodiscard]] bool has(std::size_t operations) const {
    return spent_ == 0 || operations <= limit_ - std::min(spent_, limit_);
  }
  void spend(std::size_t operations) { spent_ += operations; }
  [[nodiscard]] std::size_t spent() const { return spent_; }

 private:
  std::size_t limit_, spent_ = 0;
};

}  // namespace lightwell::specular
