// Aligns two cameras that run through the same cycle of exposures, so that simultaneous frames have the same exposure.
#pragma once

#include <optional>
#include <span>

namespace lightwell::libcam {

/// Index of the exposure in the cycle. Empty if none matches, or more than one (within kExposureTolerance).
[[nodiscard]] std::optional<int> index_in_cycle(std::span<const double> exposure_s, double in_force_s);

/// Whether all exposures of the cycle differ by more than the tolerance, so that an exposure determines its index.
[[nodiscard]] bool distinct(std::span<const double> exposure_s);

/// A correction takes effect some frames after it was made; until then disagreeing pairs do not cause another one.
class CycleAlignment {
 public:
  /// `patience`: number of pairs until a correction has taken effect.
  CycleAlignment(int size, int patience) : size_(size), patience_(patience) {}

  /// Takes the cycle indices of a pair of frames. Returns the number of exposures by which the second camera's next
  /// request must be advanced; 0: none.
  [[nodiscard]] int observe(int first, int second);
  void restart() { waited_ = patience_; }

 private:
  int size_, patience_;
  int waited_ = patience_;
};

}  // namespace lightwell::libcam
