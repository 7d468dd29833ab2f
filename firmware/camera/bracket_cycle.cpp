#include "camera/bracket_cycle.hpp"

#include <cmath>
#include <limits>

namespace lightwell {

ReportedCycle::ReportedCycle(std::span<const double> exposure_s)
    : size_(std::min(exposure_s.size(), static_cast<std::size_t>(kMaxBracket))) {
  std::copy_n(exposure_s.begin(), size_, cycle_.begin());
}

std::optional<int> ReportedCycle::index_of(double exposure_s) const {
  // A bracket may contain an exposure twice: prefer the index that follows the previous frame's, if it fits.
  const auto fits = [&](int i) {
    const double declared = cycle_[static_cast<std::size_t>(i)];
    return std::abs(exposure_s - declared) <= kExposureTolerance * declared;
  };
  if (fits(after_last())) return after_last();
  std::optional<int> best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < static_cast<int>(size_); ++i) {
    const double off = std::abs(exposure_s - cycle_[static_cast<std::size_t>(i)]);
    if (!fits(i) || off >= least) continue;
    least = off;
    best = i;
  }
  return best;
}

std::optional<CyclePlace> ReportedCycle::place(std::uint64_t camera_sequence, double exposure_s) {
  if (!fresh_ && camera_sequence <= camera_last_) return std::nullopt;
  const std::optional<int> index = index_of(exposure_s);
  if (!index) return std::nullopt;
  if (fresh_) shift_ = (last_ ? last_->sequence + 1 : 0) - camera_sequence;
  fresh_ = false;
  camera_last_ = camera_sequence;
  const bool follows = last_ && camera_sequence + shift_ == last_->sequence + 1;
  if (follows && *index != after_last()) ++shift_;
  last_ = CyclePlace{*index, camera_sequence + shift_};
  return last_;
}

CyclePlace HeldCycle::take() {
  const CyclePlace place{index_, next_sequence_++};
  index_ = (index_ + 1) % size_;
  if (size_ > 1) requested_at_.reset();
  return place;
}

}  // namespace lightwell
