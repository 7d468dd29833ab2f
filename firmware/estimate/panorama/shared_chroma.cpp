#include "estimate/panorama/shared_chroma.hpp"

#include <algorithm>

#include "estimate/panorama/kernels/lane_sums.hpp"
#include "imaging/frame.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell::estimate {
namespace {

/// Reads row kRowStep / 2 and each kRowStep rows after it.
constexpr int kRowStep = 16;

}  // namespace

SharedChroma::SharedChroma(const RigParameters& rig, const RigTable& table) {
  for (std::size_t k = 0; k < table.lenses.size(); ++k) {
    const LensTable& lens = table.lenses[k];
    Lens& out = lenses_.emplace_back();
    for (int y = kRowStep / 2; y < lens.height; y += kRowStep) {
      const RowSpan span = lens.rows[static_cast<std::size_t>(y)];
      Row row{y, (span.first + 1) & ~1, span.end & ~1, 0};
      if (row.begin >= row.end) continue;
      for (int x = row.begin; x < row.end; ++x) row.sr += lens.solid_angle[lens.index(x, y)];
      row.sr *= static_cast<float>(kRowStep) / static_cast<float>(row.end - row.begin);
      out.rows.push_back(row);
    }
    const auto& white = rig.lenses[k].photometry.white_balance;
    out.largest_white = static_cast<float>(*std::ranges::max_element(white));
  }
}

double SharedChroma::error(const RowReader& reader) const {
  const PixelLayout& layout = reader.layout();
  if (layout.sampling != ColorSampling::ycbcr) return 0;
  const bool own_plane = layout.planes == 2;
  double largest = 0;
  for (const RowReader::Exposure& exposure : reader.exposures()) {
    double sum = 0;
    for (std::size_t k = 0; k < lenses_.size(); ++k) {
      if (!reader.has(static_cast<int>(k))) continue;
      const View& view = exposure.view[k];
      double of_lens = 0;
      for (const Row& row : lenses_[k].rows) {
        const auto count = static_cast<std::size_t>(row.end - row.begin);
        const std::uint64_t changes =
            own_plane ? chroma_changes_of_nv12(row_of(view, row.y) + row.begin,
                                               row_of(view, view.height + row.y / 2) + row.begin, count)
                      : chroma_changes_of_yuyv(row_of(view, row.y) + 2 * row.begin, count);
        of_lens += static_cast<double>(row.sr) * static_cast<double>(changes);
      }
      sum += of_lens * static_cast<double>(lenses_[k].largest_white);
    }
    largest = std::max(largest, sum * static_cast<double>(exposure.radiance_per_linear));
  }
  // NV12 shares chroma in both directions.
  return largest * (own_plane ? 2 : 1) / (255.0 * 255.0);
}

}  // namespace lightwell::estimate
