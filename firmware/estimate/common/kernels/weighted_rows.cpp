#include "estimate/common/kernels/weighted_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/common/kernels/weighted_rows.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Adds kVectors vectors of columns from `first` on; their 3 * kVectors sums stay in registers.
template <std::size_t kVectors, class D>
HWY_INLINE void add_columns(D d, const float* rows, const float* weights, std::size_t count, std::size_t first,
                            float (&out)[3][kRowFloats]) {
  hn::Vec<D> sum[3][kVectors];
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t v = 0; v < kVectors; ++v) sum[c][v] = hn::LoadU(d, out[c] + first + v * hn::Lanes(d));
  for (std::size_t k = 0; k < count; ++k) {
    const auto r = hn::Set(d, weights[3 * k]), g = hn::Set(d, weights[3 * k + 1]), b = hn::Set(d, weights[3 * k + 2]);
    for (std::size_t v = 0; v < kVectors; ++v) {
      const auto row = hn::LoadU(d, rows + k * kRowFloats + first + v * hn::Lanes(d));
      sum[0][v] = hn::MulAdd(row, r, sum[0][v]);
      sum[1][v] = hn::MulAdd(row, g, sum[1][v]);
      sum[2][v] = hn::MulAdd(row, b, sum[2][v]);
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t v = 0; v < kVectors; ++v) hn::StoreU(sum[c][v], d, out[c] + first + v * hn::Lanes(d));
}

void AddWeightedRows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowFloats]) {
  const hn::CappedTag<float, 16> d;
  const std::size_t lanes = hn::Lanes(d);
  // A row has 7 vectors of 16 lanes, 14 of 8 or 28 of 4: seven at a time where there are registers for 21 sums.
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  constexpr std::size_t kAtOnce = 7;
#elif HWY_ARCH_ARM_A64
  constexpr std::size_t kAtOnce = 7;
#else
  constexpr std::size_t kAtOnce = 4;
#endif
  std::size_t first = 0;
  for (; first + kAtOnce * lanes <= kRowFloats; first += kAtOnce * lanes)
    add_columns<kAtOnce>(d, rows, weights, count, first, out);
  for (; first < kRowFloats; first += lanes) add_columns<1>(d, rows, weights, count, first, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(AddWeightedRows);

void add_weighted_rows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowFloats]) {
  HWY_DYNAMIC_DISPATCH(AddWeightedRows)(rows, weights, count, out);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
