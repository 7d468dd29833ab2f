// Streaming medians with bounded memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace lightwell::specular {

/// Stochastic approximation of the median of three channels (Robbins & Monro 1951; the step is Tierney's 1983, "A
/// Space-Efficient Recursive Procedure for Estimating a Quantile of an Unknown Distribution", with the density of a
/// normal distribution of the same mean absolute deviation). 20 bytes.
class RunningMedian {
 public:
  /// Values must be finite.
  void add(float r, float g, float b) {
    const float value[3] = {r, g, b};
    if (count_ == 0) {
      std::copy(value, value + 3, median_);
      count_ = 1;
      return;
    }
    float deviation = 0;
    for (int c = 0; c < 3; ++c) deviation = std::max(deviation, std::abs(value[c] - median_[c]));
    count_ = std::min<std::uint32_t>(count_ + 1, kMemory);
    // Half of the memory: a new level is reached when the old one is forgotten.
    deviation_ +=
        (deviation - deviation_) / static_cast<float>(count_ < 3 ? 1 : std::min<std::uint32_t>(count_, kMemory / 2));
    // sqrt(pi / 2) mean absolute deviations are a sigma; 1 / (2 f(median)) = sqrt(pi / 2) sigma.
    const float step = 1.57F * deviation_ / static_cast<float>(count_);
    for (int c = 0; c < 3; ++c) median_[c] += std::clamp(value[c] - median_[c], -step, step);
  }

  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] const float (&value() const)[3] { return median_; }
  /// Running mean of the largest absolute deviation over the channels.
  [[nodiscard]] float deviation() const { return deviation_; }

  /// Values after which older ones are forgotten.
  static constexpr std::uint32_t kMemory = 256;

 private:
  float median_[3] = {};
  float deviation_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace lightwell::specular
