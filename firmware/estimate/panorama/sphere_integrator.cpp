#include "estimate/panorama/sphere_integrator.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::estimate {
namespace {

/// Largest error without centroid correction: luminance of a cell times the centroid's offset, rad, relative to the
/// luminance of all cells.
constexpr double kMaxCentroidError = 2e-6;
constexpr std::size_t kMaxCentroidCorrections = 4096;

}  // namespace

SphereIntegrator::SphereIntegrator(const RigParameters& rig, const RigTable& table, int edge)
    : table_(table),
      layout_(table, edge),
      grid_(layout_.make_grid(table)),
      block_pass_(table, layout_),
      code_pass_(rig, table, layout_),
      bracket_pass_(rig, table, layout_),
      unseen_(rig, table, layout_, grid_),
      integral_(layout_, unseen_.cells().size()),
      pixel_rad_(pixel_side(table)) {
  centroid_overrides_.reserve(kMaxCentroidCorrections);
  offset_luminance_.resize(layout_.size());
  bilinear_samples_.resize(kMaxCentroidCorrections);
  offset_blocks_.resize(kMaxCentroidCorrections + 1);
}

const FrameIntegral& SphereIntegrator::integrate(RowReader& reader, std::span<const Frame> bracket, UnseenFill fill) {
  FrameIntegral& out = integral_;
  if (code_pass_.supports(bracket)) {
    code_pass_.run(bracket[0], out.blocks);
  } else if (bracket_pass_.supports(bracket)) {
    bracket_pass_.run(bracket, out.blocks);
    reader.limit_exposures_per_block(layout_, out.blocks.exposures);
  } else {
    block_pass_.run(reader, out.blocks);
  }
  unsigned present = 0;
  for (int lens = 0; lens < layout_.lens_count(); ++lens)
    if (reader.has(lens)) present |= 1U << lens;
  const double luminance = sum_observed(present);
  correct_centroids(luminance);
  out.filled = unseen_.fill(fill, present, bracket.front().info.mid_exposure, out.blocks.sum, out.unseen);
  grid_.project(out.blocks.sum, centroid_overrides_, out.projection);
  if (!out.filled || out.unseen.empty()) return out;
  unseen_.cells().project(out.unseen, {}, unseen_projection_);
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.projection.c[i][k] += unseen_projection_.c[i][k];
  return out;
}

double SphereIntegrator::sum_observed(unsigned present) {
  BlockSums& blocks = integral_.blocks;
  double observed_sr = 0, luminance = 0;
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    const std::size_t first = layout_.first(lens);
    const std::size_t end = lens + 1 < layout_.lens_count() ? layout_.first(lens + 1) : layout_.size();
    for (std::size_t block = first; block < end; ++block) {
      if ((present >> lens & 1U) == 0) {
        blocks.sum[block] = {};
        blocks.peak[block] = blocks.offset_x[block] = blocks.offset_y[block] = 0;
        continue;
      }
      observed_sr += grid_.solid_angle(block);
      luminance += blocks.sum[block].luminance();
    }
  }
  integral_.observed_sr = observed_sr;
  integral_.mean_luminance = static_cast<float>(luminance / std::max(observed_sr, 1e-12));
  return luminance;
}

std::vector<Vec3f> SphereIntegrator::cell_directions() const {
  std::vector<Vec3f> out;
  for (const CellGrid* grid : {&grid_, &unseen_.cells()})
    for (std::size_t cell = 0; cell < grid->size(); ++cell) out.push_back(grid->direction(cell));
  return out;
}

std::vector<float> SphereIntegrator::cell_solid_angles() const {
  std::vector<float> out;
  for (const CellGrid* grid : {&grid_, &unseen_.cells()})
    for (std::size_t cell = 0; cell < grid->size(); ++cell) out.push_back(grid->solid_angle(cell));
  return out;
}

SphereIntegrator::BilinearSample SphereIntegrator::bilinear_sample_of(std::size_t block) const {
  const BlockLayout::Place p = layout_.place(block);
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
  const BlockLayout::Middle middle = layout_.middle(block);
  const BlockSums& blocks = integral_.blocks;
  const float x = std::clamp(middle.x + blocks.offset_x[block], 0.0F, static_cast<float>(p.width - 1));
  const float y = std::clamp(middle.y + blocks.offset_y[block], 0.0F, static_cast<float>(p.height - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(p.width - 2, 0)),
            y0 = std::min(static_cast<int>(y), std::max(p.height - 2, 0));
  const Vec3f* at = &lens.direction[lens.index(p.x + x0, p.y + y0)];
  return {at, p.width > 1 ? 1 : 0, p.height > 1 ? lens.width : 0, x - static_cast<float>(x0),
          y - static_cast<float>(y0)};
}

Vec3d SphereIntegrator::direction_at(const BilinearSample& sample) {
  const auto interpolate = [](Vec3f a, Vec3f b, float fraction) { return a * (1 - fraction) + b * fraction; };
  const Vec3f upper = interpolate(sample.at[0], sample.at[sample.right], sample.x),
              lower = interpolate(sample.at[sample.down], sample.at[sample.down + sample.right], sample.x);
  return normalized(vec_cast<double>(interpolate(upper, lower, sample.y)));
}

void SphereIntegrator::correct_centroids(double luminance) {
  const BlockSums& sums = integral_.blocks;
  centroid_overrides_.clear();
  integral_.centroid_offset = 0;
  if (!(luminance > 0)) return;
  const auto limit = static_cast<float>(kMaxCentroidError * luminance / pixel_rad_);
  const std::size_t blocks = sums.sum.size();
  for (std::size_t block = 0; block < blocks; ++block) {
    const float x = sums.offset_x[block], y = sums.offset_y[block];
    offset_luminance_[block] = std::max(sums.sum[block].luminance(), 0.0F) * std::sqrt(x * x + y * y);
  }
  // Four independent sums hide the latency of additions.
  double remaining4[4] = {};
  std::size_t count = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    const float offset_luminance = offset_luminance_[block];
    // Written unconditionally, counted if above the limit: the branch would be unpredictable.
    offset_blocks_[count] = static_cast<std::uint32_t>(block);
    const bool corrected = offset_luminance > limit && count < kMaxCentroidCorrections;
    count += static_cast<std::size_t>(corrected);
    remaining4[block % 4] += corrected ? 0 : offset_luminance;
  }
  double remaining = remaining4[0] + remaining4[1] + remaining4[2] + remaining4[3];
  // The directions are spread over large tables: all are prefetched before the first is used.
  for (std::size_t k = 0; k < count; ++k) {
    bilinear_samples_[k] = bilinear_sample_of(offset_blocks_[k]);
    __builtin_prefetch(bilinear_samples_[k].at);
    __builtin_prefetch(bilinear_samples_[k].at + bilinear_samples_[k].down);
  }
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3d d = direction_at(bilinear_samples_[k]);
    if (d == Vec3d{})
      remaining += offset_luminance_[offset_blocks_[k]];
    else
      centroid_overrides_.push_back({offset_blocks_[k], d});
  }
  integral_.centroid_offset = remaining * pixel_rad_;
}

}  // namespace lightwell::estimate
