#include "estimate/panorama/texel_sums.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::estimate {
namespace {

/// Smallest width of a texel in pixels. A pixel counts for the texel of its middle: with four pixels across, the edge
/// of a texel is displaced by a tenth of its width (root mean square).
constexpr double kMinTexelPixels = 4;
/// Share of a texel's solid angle from which its pixels alone count: sums of whole pixels vary around 1 inside of the
/// picture, and below this share the texel is at its edge.
constexpr float kFullShare = 0.75F;

}  // namespace

TexelSums::TexelSums(const RigTable& table, const BlockLayout& layout, const OctahedralGrid& grid)
    : table_(table), layout_(layout), texels_(grid.texels()), row_(max_image_width(table)) {
  for (const LensTable& lens : table.lenses) {
    std::vector<std::uint16_t>& texel = texel_.emplace_back();
    texel.reserve(lens.direction.size());
    for (const Vec3f d : lens.direction) texel.push_back(static_cast<std::uint16_t>(grid.texel_of(d)));
  }
  for (const double sr : grid.solid_angle) inverse_solid_angle_.push_back(static_cast<float>(1 / sr));
}

bool TexelSums::resolved(const RigTable& table, const OctahedralGrid& grid) {
  return std::sqrt(kSphere) / grid.edge >= kMinTexelPixels * pixel_side(table);
}

std::span<Rgbx> TexelSums::run(RowReader& reader, std::size_t exposures) {
  std::fill(texels_.begin(), texels_.end(), Rgbx{});
  ReadStatistics ignored;
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    if (!reader.has(lens)) continue;
    const LensTable& table = table_.lenses[static_cast<std::size_t>(lens)];
    const std::vector<std::uint16_t>& texel = texel_[static_cast<std::size_t>(lens)];
    for (int y = 0; y < table.height; ++y) {
      const RowSpan span = table.rows[static_cast<std::size_t>(y)];
      for (int x = span.first, end = 0; x < span.end; x = end) {
        // In a bracket a read must not extend beyond its block.
        end = exposures > 1 ? std::min((x | (layout_.edge() - 1)) + 1, span.end) : span.end;
        reader.read(lens, y, x, end, RowReader::Reading::radiance, row_, ignored);
        const std::size_t first = table.index(x, y);
        for (std::size_t i = 0; i < static_cast<std::size_t>(end - x); ++i) {
          const float sr = table.solid_angle[first + i];
          Rgbx& sum = texels_[texel[first + i]];
          sum.v[0] += sr * row_.r[i];
          sum.v[1] += sr * row_.g[i];
          sum.v[2] += sr * row_.b[i];
          sum.v[3] += sr;
        }
      }
    }
  }
  for (std::size_t k = 0; k < texels_.size(); ++k) {
    Rgbx& t = texels_[k];
    const float sr = t.v[3], inverse = sr > 0 ? 1 / sr : 0;
    t.v = {t.v[0] * inverse, t.v[1] * inverse, t.v[2] * inverse,
           std::min(sr * inverse_solid_angle_[k] / kFullShare, 1.0F)};
  }
  return texels_;
}

}  // namespace lightwell::estimate
