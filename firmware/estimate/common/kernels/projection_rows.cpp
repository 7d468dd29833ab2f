#include "estimate/common/cells.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/common/kernels/projection_rows.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

#ifndef LIGHTWELL_KERNELS_PROJECTION_ROWS_ONCE
#define LIGHTWELL_KERNELS_PROJECTION_ROWS_ONCE
namespace lightwell::estimate {

constexpr int kTop = kTailBands.back();

/// Coefficients of the SH recursion in float, and the index of the basis function (l, 0) in a BasisRow, or -1.
struct PointTable {
  std::array<float, kTop + 1> start{};
  std::array<std::array<float, kTop + 1>, kTop + 1> a{}, b{};
  std::array<int, kTop + 1> middle{};

  PointTable() {
    for (std::size_t m = 0; m <= kTop; ++m) {
      start[m] = static_cast<float>(sh_recursion().start[m]);
      for (std::size_t l = 0; l <= kTop; ++l) {
        a[l][m] = static_cast<float>(sh_recursion().a[l][m]);
        b[l][m] = static_cast<float>(sh_recursion().b[l][m]);
      }
    }
    middle.fill(-1);
    for (int l = 0; l <= kMaxBand; ++l) middle[static_cast<std::size_t>(l)] = sh_index(l, 0);
    int at = sh_count(kMaxBand);
    for (const int l : kTailBands) {
      middle[static_cast<std::size_t>(l)] = at + l;
      at += 2 * l + 1;
    }
  }
};

}  // namespace lightwell::estimate
#endif  // LIGHTWELL_KERNELS_PROJECTION_ROWS_ONCE

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Adds kVectors vectors of columns from `first` on; their 3 * kVectors sums stay in registers.
template <std::size_t kVectors, class D>
HWY_INLINE void add_columns(D d, const float* rows, const float* weights, std::size_t count, std::size_t first,
                            float (&out)[3][kRowCount]) {
  hn::Vec<D> sum[3][kVectors];
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t v = 0; v < kVectors; ++v) sum[c][v] = hn::LoadU(d, out[c] + first + v * hn::Lanes(d));
  for (std::size_t k = 0; k < count; ++k) {
    const auto r = hn::Set(d, weights[3 * k]), g = hn::Set(d, weights[3 * k + 1]), b = hn::Set(d, weights[3 * k + 2]);
    for (std::size_t v = 0; v < kVectors; ++v) {
      const auto row = hn::LoadU(d, rows + k * kRowCount + first + v * hn::Lanes(d));
      sum[0][v] = hn::MulAdd(row, r, sum[0][v]);
      sum[1][v] = hn::MulAdd(row, g, sum[1][v]);
      sum[2][v] = hn::MulAdd(row, b, sum[2][v]);
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t v = 0; v < kVectors; ++v) hn::StoreU(sum[c][v], d, out[c] + first + v * hn::Lanes(d));
}

void AddWeightedRows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowCount]) {
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
  for (; first + kAtOnce * lanes <= kRowCount; first += kAtOnce * lanes)
    add_columns<kAtOnce>(d, rows, weights, count, first, out);
  for (; first < kRowCount; first += lanes) add_columns<1>(d, rows, weights, count, first, out);
}

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

/// Adds value * (r, g, b) to the sums of one basis function: three vectors, whose lanes are summed at the end.
HWY_INLINE void add_product(D d, V value, V r, V g, V b, int row, float* sums) {
  const std::size_t lanes = hn::Lanes(d);
  float* at = sums + 3 * static_cast<std::size_t>(row) * lanes;
  hn::Store(hn::MulAdd(value, r, hn::Load(d, at)), d, at);
  hn::Store(hn::MulAdd(value, g, hn::Load(d, at + lanes)), d, at + lanes);
  hn::Store(hn::MulAdd(value, b, hn::Load(d, at + 2 * lanes)), d, at + 2 * lanes);
}

void AddPoints(const PointTable& table, const LightPoints& points, float (&out)[3][kRowCount]) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  alignas(64) float sums[3 * kRowCount * 16];
  for (std::size_t i = 0; i < 3 * kRowCount * lanes; i += lanes) hn::Store(hn::Zero(d), d, sums + i);
  for (std::size_t k = 0; k < points.count; k += lanes) {
    // Lanes beyond the last point hold old values, which are masked out.
    const auto there = hn::FirstN(d, points.count - k);
    const V x = hn::Load(d, points.x.data() + k), y = hn::Load(d, points.y.data() + k),
            z = hn::Load(d, points.z.data() + k);
    const V r = hn::IfThenElseZero(there, hn::Load(d, points.r.data() + k));
    const V g = hn::IfThenElseZero(there, hn::Load(d, points.g.data() + k));
    const V b = hn::IfThenElseZero(there, hn::Load(d, points.b.data() + k));
    V re = hn::Set(d, 1.0F), im = hn::Zero(d);
    for (int m = 0; m <= kTop; ++m) {
      const auto order = static_cast<std::size_t>(m);
      V previous = hn::Zero(d), current = hn::Set(d, table.start[order]);
      for (int l = m;; ++l) {
        if (const int middle = table.middle[static_cast<std::size_t>(l)]; middle >= 0) {
          add_product(d, hn::Mul(current, re), r, g, b, middle + m, sums);
          if (m > 0) add_product(d, hn::Mul(current, im), r, g, b, middle - m, sums);
        }
        if (l == kTop) break;
        const auto up = static_cast<std::size_t>(l) + 1;
        const V lower = hn::Mul(hn::Set(d, table.b[up][order]), previous);
        const V next = hn::Mul(hn::Set(d, table.a[up][order]), hn::MulSub(z, current, lower));
        previous = current;
        current = next;
      }
      const V turned = hn::NegMulAdd(im, y, hn::Mul(re, x));
      im = hn::MulAdd(re, y, hn::Mul(im, x));
      re = turned;
    }
  }
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      out[c][i] += hn::GetLane(hn::SumOfLanes(d, hn::Load(d, sums + (3 * i + c) * lanes)));
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(AddWeightedRows);
HWY_EXPORT(AddPoints);

void add_weighted_rows(const float* rows, const float* weights, std::size_t count, float (&out)[3][kRowCount]) {
  HWY_DYNAMIC_DISPATCH(AddWeightedRows)(rows, weights, count, out);
}

void add_points(const LightPoints& points, float (&out)[3][kRowCount]) {
  static const PointTable table;
  HWY_DYNAMIC_DISPATCH(AddPoints)(table, points, out);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
