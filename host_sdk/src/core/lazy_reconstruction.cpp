#include "core/lazy_reconstruction.hpp"

namespace lightwell::core {

LazyReconstruction::LazyReconstruction(const Pointer& from, Quat q)
    : a_(from->a_ ? from->a_ : from), b_(from->b_), f_(from->f_), q_(from->q_ ? q * *from->q_ : q) {}

const RadianceReconstruction* LazyReconstruction::ready() const {
  // Most queries find it set: a store by every thread that shades would pass the cache line round.
  if (!queried()) queried_.store(true, std::memory_order_relaxed);
  return state_.load(std::memory_order_acquire) == State::ready ? &kept_ : nullptr;
}

RadianceReconstruction LazyReconstruction::value() const {
  const RadianceReconstruction* const kept = ready();
  return kept != nullptr ? *kept : compute();
}

RadianceReconstruction LazyReconstruction::compute() const {
  RadianceReconstruction result = a_ ? a_->value() : reconstruct(sh_);
  if (b_) result = interpolated(result, b_->value(), f_);
  if (q_) result = rotated(result, *q_);
  State empty = State::empty;
  if (state_.compare_exchange_strong(empty, State::writing, std::memory_order_acquire)) {
    kept_ = result;
    state_.store(State::ready, std::memory_order_release);
  }
  return result;
}

void ReconstructAhead::published(const LazyReconstruction* before, const LazyReconstruction* newest) {
  without_query_ = before != nullptr && before->queried() ? 0 : without_query_ + 1;
  if (newest != nullptr && without_query_ < kMaxWithoutQuery) (void)newest->compute();
}

}  // namespace lightwell::core
