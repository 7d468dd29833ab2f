// Two cameras that each go through the same cycle of exposures, brought to have the same one at the same time.
#pragma once

#include <optional>
#include <span>

namespace lightwell::libcam {

/// Which exposure of the cycle that is. Nothing where it is none, or where the cycle has several that are alike.
[[nodiscard]] std::optional<int> index_in_cycle(std::span<const double> exposure_s, double in_force_s);

/// Whether all exposures of the cycle can be told from each other.
[[nodiscard]] bool distinct(std::span<const double> exposure_s);

/// A correction shows some frames after it was made: meanwhile pairs still disagree, and are no reason for another one.
class CycleAlignment {
 public:
  /// `patience`: pairs that a correction may take to show.
  CycleAlignment(int size, int patience) : size_(size), patience_(patience) {}

  /// Of a pair of frames, the places of both in the cycle. By how many places the second camera's next request has to
  /// be moved on; 0 where nothing is to be done.
  [[nodiscard]] int observe(int first, int second);
  void restart() { waited_ = patience_; }

 private:
  int size_, patience_;
  int waited_ = patience_;
};

}  // namespace lightwell::libcam
