// Search for the roughness at which the misfit of the deconvolution has the expected value.
#pragma once

#include <algorithm>
#include <cmath>

namespace lightwell::specular {

/// The misfit rises with alpha. Searches log alpha, in kCells equal cells, for the cell at whose lower edge the misfit
/// is not too large and at whose upper edge it is: by bisection of the whole range, or from the cell of an earlier
/// answer outwards in growing steps (Bentley & Yao 1976, "An almost optimal algorithm for unbounded searching").
class RoughnessSearch {
 public:
  /// Below this the lobe is narrower than the grid, above it the plane is nearly matte.
  static constexpr double kMinAlpha = 0.02, kMaxAlpha = 0.5;
  static constexpr int kCells = 64;

  /// In the whole range: six evaluations.
  RoughnessSearch() = default;
  /// From the cell of `alpha`: at most two evaluations where the answer is still in it.
  explicit RoughnessSearch(double alpha)
      : low_(std::clamp(static_cast<int>(std::log(alpha / kMinAlpha) / width()), 0, kCells - 1)),
        high_(low_ + 1),
        low_known_(low_ == 0),
        high_known_(high_ == kCells) {}

  [[nodiscard]] bool done() const { return low_known_ && high_known_ && high_ - low_ == 1; }
  /// The next alpha to evaluate; when done, the answer, to 2.5 %.
  [[nodiscard]] double alpha() const {
    return std::exp(std::log(kMinAlpha) + width() * (done() ? low_ + 0.5 : edge()));
  }

  /// The misfit at alpha(), relative to the expected one. Not to be called when done.
  void add(double relative_misfit) {
    const bool too_rough = relative_misfit > 1;
    if (low_known_ && high_known_) {
      (too_rough ? high_ : low_) = edge();
    } else if (!low_known_ && too_rough) {
      high_ = low_, high_known_ = true;
      low_ = std::max(low_ - step_, 0), low_known_ = low_ == 0;
      step_ *= 2;
    } else if (!low_known_) {
      low_known_ = true;
    } else if (too_rough) {
      high_known_ = true;
    } else {
      low_ = high_;
      high_ = std::min(high_ + step_, kCells), high_known_ = high_ == kCells;
      step_ *= 2;
    }
  }

 private:
  /// Of a cell, in log alpha.
  [[nodiscard]] static double width() { return std::log(kMaxAlpha / kMinAlpha) / kCells; }
  [[nodiscard]] int edge() const { return !low_known_ ? low_ : !high_known_ ? high_ : (low_ + high_) / 2; }

  int low_ = 0, high_ = kCells;                ///< Edges around the answer,
  bool low_known_ = true, high_known_ = true;  ///< where they are known to be.
  int step_ = 2;
};

}  // namespace lightwell::specular
