#include "camera/backends/libcamera/cycle_alignment.hpp"

#include <cmath>

#include "camera/bracket_cycle.hpp"

namespace lightwell::libcam {

std::optional<int> index_in_cycle(std::span<const double> exposure_s, double in_force_s) {
  std::optional<int> found;
  for (std::size_t i = 0; i < exposure_s.size(); ++i) {
    if (!(std::abs(in_force_s - exposure_s[i]) <= kExposureTolerance * exposure_s[i])) continue;
    if (found) return std::nullopt;
    found = static_cast<int>(i);
  }
  return found;
}

bool distinct(std::span<const double> exposure_s) {
  // No value may be within the tolerance of two exposures.
  for (std::size_t i = 0; i < exposure_s.size(); ++i)
    for (std::size_t k = 0; k < exposure_s.size(); ++k)
      if (i != k && std::abs(exposure_s[i] - exposure_s[k]) <= kExposureTolerance * (exposure_s[i] + exposure_s[k]))
        return false;
  return true;
}

int CycleAlignment::observe(int first, int second) {
  const int apart = ((first - second) % size_ + size_) % size_;
  if (apart == 0) {
    waited_ = patience_;
    return 0;
  }
  if (waited_ < patience_) {
    ++waited_;
    return 0;
  }
  waited_ = 0;
  return apart;
}

}  // namespace lightwell::libcam
