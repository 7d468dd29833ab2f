#include "estimate/common/environment_filter.hpp"

#include <algorithm>
#include <array>

#include "estimate/common/environment_splat.hpp"

namespace lightwell::estimate {
namespace {

constexpr int kMaxBaseEdge = 64;
/// Samples along an edge of the square: 0.3 to 1.5 degrees apart, fine compared with the cells of any rig.
constexpr int kSamplesAcross = 256;

OctahedralGrid base_grid(int edge) {
  const int base = std::min(2 * edge, kMaxBaseEdge);
  return {base, kSamplesAcross / base};
}

}  // namespace

std::vector<EnvironmentLevel> environment_levels(int edge) {
  if (!is_environment_edge(static_cast<std::uint64_t>(std::max(edge, 0)))) return {};
  if (edge == 8) return {{8, 0}, {8, 0.5F}, {8, 0.75F}, {8, 1}};
  // The lobe's full width at half maximum is 2.6 roughness² rad, the mean width of a texel 3.5 / edge rad.
  const int middle = std::min(edge, 32), wide = std::min(edge / 2, 16);
  return {{edge, 0}, {middle, 0.25F}, {edge == 64 ? 32 : 16, 0.5F}, {wide, 0.75F}, {wide, 1}};
}

EnvironmentFilter::EnvironmentFilter(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge)
    : levels_(environment_levels(edge)),
      base_(base_grid(levels_.empty() ? 8 : edge)),
      pyramid_(base_),
      splat_(splat_rows(direction, solid_angle, base_)),
      light_(std::min(direction.size(), solid_angle.size())),
      means_(pyramid_.size()),
      texels_(texel_count(levels_)) {
  for (std::size_t k = 1; k < levels_.size(); ++k)
    lobes_.push_back(lobe_rows(base_, pyramid_, levels_[k].edge, static_cast<double>(levels_[k].roughness)));
}

std::size_t EnvironmentFilter::weights() const {
  std::size_t count = splat_.entries();
  for (const auto& layer : pyramid_.layers()) count += layer.means.entries();
  for (const SparseRows& rows : lobes_) count += rows.entries();
  return count;
}

std::span<const Rgbx> EnvironmentFilter::run(std::span<const CellSum> sums) {
  const auto clean = [](float v) { return v > 0 && v <= kMaxCellSum ? v : 0.0F; };
  for (std::size_t c = 0; c < light_.size(); ++c) {
    const CellSum s = c < sums.size() ? sums[c] : CellSum{};
    light_[c].v = {clean(s.r), clean(s.g), clean(s.b), 0};
  }
  splat_.apply(light_, std::span(means_).first(splat_.rows()));
  pyramid_.apply(means_);
  if (levels_.empty()) return {};
  const auto sharp = std::find_if(pyramid_.layers().begin(), pyramid_.layers().end(),
                                  [this](const auto& layer) { return layer.edge == levels_[0].edge; });
  std::size_t next = texel_count(std::span(levels_).first(1));
  std::copy_n(means_.begin() + static_cast<std::ptrdiff_t>(sharp->first), next, texels_.begin());
  for (const SparseRows& rows : lobes_) {
    rows.apply(means_, std::span(texels_).subspan(next, rows.rows()));
    next += rows.rows();
  }
  return texels_;
}

}  // namespace lightwell::estimate
