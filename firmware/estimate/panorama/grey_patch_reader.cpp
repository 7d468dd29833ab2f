#include "estimate/panorama/grey_patch_reader.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/color.hpp>

namespace lightwell::estimate {

std::optional<DiffuseConstraint> GreyPatchReader::read(RowReader& reader, double factor) {
  if (!reader.has(patch_.lens)) return std::nullopt;
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(patch_.lens)];
  double luminance = 0, pixels = 0;
  ReadStatistics ignored;
  for (int y = patch_.y; y < patch_.y + patch_.height; ++y) {
    // A read must not extend beyond its block.
    for (int x = patch_.x, end = 0; x < patch_.x + patch_.width; x = end) {
      end = std::min((x | (layout_.edge() - 1)) + 1, patch_.x + patch_.width);
      reader.read(patch_.lens, y, x, end, RowReader::Reading::with_clipped, row_, ignored);
      for (int i = 0; i < end - x; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (!row_.certain && row_.clipped[k] != 0) return std::nullopt;
        if (!(lens.solid_angle[lens.index(x + i, y)] > 0)) continue;
        luminance += luminance_of(row_.r[k], row_.g[k], row_.b[k]);
        ++pixels;
      }
    }
  }
  if (!(luminance > 0) || !std::isfinite(luminance)) return std::nullopt;
  return DiffuseConstraint{patch_.normal, luminance / pixels * std::numbers::pi / patch_.albedo * factor};
}

}  // namespace lightwell::estimate
