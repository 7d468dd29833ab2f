#include "estimate/panorama/blocks.hpp"

#include "estimate/panorama/kernels/bracket_rows.hpp"

namespace lightwell::estimate {

double luminance_of_all(std::span<const CellSum> blocks) {
  // Four blocks at a time, 256 in float and then in double.
  constexpr std::size_t kAtOnce = 4, kInFloat = 256;
  double r = 0, g = 0, b = 0;
  std::size_t at = 0;
  while (at + kAtOnce <= blocks.size()) {
    std::array<CellSum, kAtOnce> sums{};
    const std::size_t end = std::min(at + kInFloat, blocks.size() / kAtOnce * kAtOnce);
    for (; at < end; at += kAtOnce)
      for (std::size_t i = 0; i < kAtOnce; ++i) sums[i] += blocks[at + i];
    for (const CellSum& s : sums) r += s.r, g += s.g, b += s.b;
  }
  for (; at < blocks.size(); ++at) r += blocks[at].r, g += blocks[at].g, b += blocks[at].b;
  return luminance_of(r, g, b);
}

BlockTotals BlockSums::totals_of(std::size_t begin, std::size_t end) const {
  BlockTotals out;
  for (std::size_t block = begin; block < end; ++block) {
    const RowError& rows = row_error_of_block[block];
    const auto own = static_cast<double>(rows.own);
    out += {static_cast<double>(clipped[block]),
            static_cast<double>(block_noise[block]),
            static_cast<double>(block_bias[block]),
            static_cast<double>(block_motion[block]),
            own * own,
            static_cast<double>(rows.common),
            static_cast<double>(rows.bias)};
  }
  return out;
}

BlockPass::BlockPass(const RigTable& table, const BlockLayout& layout)
    : table_(table), layout_(layout), row_(max_image_width(table)) {
  const auto n = static_cast<std::size_t>(max_image_width(table));
  for (auto* column : {&r_, &g_, &b_, &peak_, &low_, &clipped_}) column->resize(n);
}

void BlockPass::run(RowReader& reader, BlockSums& out) {
  out.clear();
  const int edge = layout_.edge();
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    if (!reader.has(lens)) continue;
    const LensTable& table = table_.lenses[static_cast<std::size_t>(lens)];
    const auto width = static_cast<std::size_t>(table.width);
    for (int top = 0; top < table.height; top += edge) {
      const int bottom = std::min(top + edge, table.height);
      for (auto* column : {&r_, &g_, &b_, &peak_, &low_, &clipped_}) std::fill_n(column->begin(), width, 0.0F);
      double noise = 0;
      for (int y = top; y < bottom; ++y) {
        const RowSpan span = table.rows[static_cast<std::size_t>(y)];
        if (span.first >= span.end) continue;
        const auto first = static_cast<std::size_t>(span.first), n = static_cast<std::size_t>(span.end - span.first);
        const float* solid_angle = table.solid_angle.data() + static_cast<std::size_t>(y) * width + first;
        const auto depth = static_cast<float>(y - top);
        // A row of valid floats is added without conversion.
        const FloatColumns columns{r_.data() + first, g_.data() + first, b_.data() + first, low_.data() + first,
                                   peak_.data() + first};
        if (const std::byte* floats = reader.floats(lens, y, span.first);
            floats != nullptr &&
            add_float_row(floats, solid_angle, n, reader.scale_of_floats(), RowReader::kMaxRadiance, depth, columns))
          continue;
        reader.read(lens, y, span.first, span.end, RowReader::Reading::with_errors, row_, out.counts);
        const float* __restrict sr = solid_angle;
        const float* __restrict r = row_.r.data();
        const float* __restrict g = row_.g.data();
        const float* __restrict b = row_.b.data();
        float* __restrict sum_r = r_.data() + first;
        float* __restrict sum_g = g_.data() + first;
        float* __restrict sum_b = b_.data() + first;
        float* __restrict peak = peak_.data() + first;
        float* __restrict low = low_.data() + first;
        for (std::size_t i = 0; i < n; ++i) {
          sum_r[i] += r[i] * sr[i];
          sum_g[i] += g[i] * sr[i];
          sum_b[i] += b[i] * sr[i];
          const float luminance = luminance_of(r[i], g[i], b[i]);
          low[i] += depth * luminance * sr[i];
          const float visible = sr[i] > 0 ? luminance : 0.0F;
          peak[i] = peak[i] > visible ? peak[i] : visible;
        }
        if (row_.certain) continue;
        // Four independent sums hide the latency of additions.
        float noise4[4] = {}, bias4[4] = {};
        float* __restrict clipped = clipped_.data() + first;
        for (std::size_t i = 0; i < n; ++i) {
          noise4[i % 4] += sr[i] * sr[i] * row_.variance[i];
          clipped[i] += row_.clipped[i] != 0 ? sr[i] : 0.0F;
          bias4[i % 4] += sr[i] * row_.bias[i];
        }
        noise += noise4[0] + noise4[1] + noise4[2] + noise4[3];
        out.bias += bias4[0] + bias4[1] + bias4[2] + bias4[3];
      }
      out.noise += noise;
      std::size_t block = layout_.block_of(lens, 0, top);
      for (std::size_t x = 0; x < width; x += static_cast<std::size_t>(edge), ++block) {
        const std::size_t end = std::min(x + static_cast<std::size_t>(edge), width);
        CellSum s;
        float peak = 0, across = 0, down = 0, clipped = 0;
        for (std::size_t i = x; i < end; ++i) {
          s.r += r_[i];
          s.g += g_[i];
          s.b += b_[i];
          peak = std::max(peak, peak_[i]);
          across += static_cast<float>(i - x) * luminance_of(r_[i], g_[i], b_[i]);
          down += low_[i];
          clipped += clipped_[i];
        }
        out.set(block, s, peak, s.luminance(), across, down, layout_.middle(block), clipped);
      }
    }
  }
}

}  // namespace lightwell::estimate
