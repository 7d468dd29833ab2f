#include "estimate/panorama/sphere_integrator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell::estimate {
namespace {

/// Number of cells over the whole sphere, about 4 degrees wide: the filling is not more precise than that.
constexpr int kCells = 2562;
/// Time constant of the mean.
constexpr double kMeanTimeConstant_s = 2;
constexpr unsigned kAllLenses = (1U << kMaxLenses) - 1;

Vec3d mirrored(Vec3d d, Vec3d axis) { return d - axis * (2 * dot(d, axis)); }

/// Largest error without centroid correction: luminance times the centroid's offset, rad, relative to all luminance.
constexpr double kMaxCentroidError = 2e-6;
constexpr std::size_t kMaxCentroidCorrections = 4096;

}  // namespace

UnseenLight::UnseenLight(const RigParameters& rig, const RigTable& table, const BlockLayout& layout,
                         const CellGrid& grid)
    : table_(table), layout_(layout), grid_(grid), mean_(layout.size()), has_mean_(rig.lenses.size()) {
  for (const LensParameters& lens : rig.lenses)
    lenses_.push_back({CameraModel(lens), lens.pose_cv.rotation.normalized().inverse()});
  const auto middle_of = [&](int lens) {
    Vec3d sum;
    for (std::size_t block = 0; block < layout.size(); ++block)
      if (lens < 0 || layout.place(block).lens == lens)
        sum += vec_cast<double>(grid.direction(block)) * static_cast<double>(grid.solid_angle(block));
    return sum;
  };

  const double missing_sr = 4 * std::numbers::pi - grid.covered_sr();
  std::vector<Vec3d> directions;
  if (!grid.whole_sphere())
    for (int i = 0; i < kCells; ++i)
      if (const Vec3d d = fibonacci_direction(i, kCells); block_seeing(d, kAllLenses) == kNoBlock)
        directions.push_back(d);
  // Without a distinct mean direction of the observed part, there is no plane to mirror at.
  const Vec3d middle = middle_of(-1);
  const bool has_centroid = length(middle) > 0.01 * grid.covered_sr();
  for (const Vec3d& d : directions) {
    const CellGrid::Pixel pixel{vec_cast<float>(d),
                                static_cast<float>(missing_sr / static_cast<double>(directions.size()))};
    cells_.add_cell({&pixel, 1});
    mirror_of_cell_.push_back(has_centroid ? block_seeing(mirrored(d, normalized(middle)), kAllLenses) : kNoBlock);
  }

  if (rig.lenses.size() < 2) return;
  for (int missing_lens = 0; missing_lens < 2; ++missing_lens) {
    const Vec3d axis = normalized(middle_of(1 - missing_lens));
    std::vector<std::uint32_t>& mirror = mirror_of_block_.emplace_back(layout.size(), kNoBlock);
    for (std::size_t block = 0; block < layout.size(); ++block)
      if (layout.place(block).lens == missing_lens && grid.solid_angle(block) > 0)
        mirror[block] = block_seeing(mirrored(vec_cast<double>(grid.direction(block)), axis), 1U << (1 - missing_lens));
  }
}

std::uint32_t UnseenLight::block_seeing(Vec3d direction, unsigned lenses) const {
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    if ((lenses >> k & 1U) == 0) continue;
    const auto at = lenses_[k].model.project(rotate(lenses_[k].from_probe, direction));
    if (!at) continue;
    const double x = std::floor(at->x + 0.5), y = std::floor(at->y + 0.5);
    const LensTable& lens = table_.lenses[k];
    if (!(x >= 0 && x < lens.width && y >= 0 && y < lens.height)) continue;
    const std::size_t block = layout_.block_of(static_cast<int>(k), static_cast<int>(x), static_cast<int>(y));
    if (grid_.solid_angle(block) > 0) return static_cast<std::uint32_t>(block);
  }
  return kNoBlock;
}

void UnseenLight::update_mean(unsigned present, ProbeTime time, std::span<const CellSum> blocks) {
  const double dt = std::max(0.0, static_cast<double>((time - last_).ns) * 1e-9);
  last_ = time;
  const auto gain = static_cast<float>(1 - std::exp(-dt / kMeanTimeConstant_s));
  for (std::size_t block = 0; block < blocks.size(); ++block) {
    const auto lens = static_cast<std::size_t>(layout_.place(block).lens);
    if ((present >> lens & 1U) == 0) continue;
    CellSum& mean = mean_[block];
    const float a = has_mean_[lens] != 0 ? gain : 1.0F;
    mean.r += a * (blocks[block].r - mean.r);
    mean.g += a * (blocks[block].g - mean.g);
    mean.b += a * (blocks[block].b - mean.b);
  }
  for (std::size_t lens = 0; lens < has_mean_.size(); ++lens)
    if ((present >> lens & 1U) != 0) has_mean_[lens] = 1;
}

bool UnseenLight::fill(UnseenFill mode, unsigned present, ProbeTime time, std::span<CellSum> blocks,
                       std::span<CellSum> unseen) {
  const unsigned all = (1U << lenses_.size()) - 1;
  if (mode == UnseenFill::average && lenses_.size() > 1) update_mean(present, time, blocks);
  std::fill(unseen.begin(), unseen.end(), CellSum{});
  if (mode == UnseenFill::none) return false;
  bool filled = false;
  if (mode == UnseenFill::mirror) {
    const auto copy = [&](std::uint32_t from, float solid_angle, CellSum& to) {
      to = {};
      if (from == kNoBlock || !(grid_.solid_angle(from) > 0)) return;
      to = blocks[from] * (solid_angle / grid_.solid_angle(from));
      filled = true;
    };
    for (std::size_t cell = 0; cell < unseen.size(); ++cell)
      copy(mirror_of_cell_[cell], cells_.solid_angle(cell), unseen[cell]);
    for (std::size_t missing_lens = 0; missing_lens < mirror_of_block_.size(); ++missing_lens)
      if ((present >> missing_lens & 1U) == 0)
        for (std::size_t block = 0; block < blocks.size(); ++block)
          if (mirror_of_block_[missing_lens][block] != kNoBlock)
            copy(mirror_of_block_[missing_lens][block], grid_.solid_angle(block), blocks[block]);
    return filled;
  }
  for (std::size_t block = 0; block < blocks.size() && present != all; ++block) {
    const auto lens = static_cast<std::size_t>(layout_.place(block).lens);
    if ((present >> lens & 1U) != 0 || has_mean_[lens] == 0) continue;
    blocks[block] = mean_[block];
    filled = true;
  }
  return filled;
}

SphereIntegrator::SphereIntegrator(const RigParameters& rig, const RigTable& table, int edge)
    : table_(table),
      layout_(table, edge),
      grid_(layout_.make_grid(table)),
      block_pass_(table, layout_),
      code_pass_(rig, table, layout_),
      bracket_pass_(rig, table, layout_),
      row_sampling_(rig, table, layout_, code_pass_.weights()),
      rotation_(layout_, grid_),
      shared_chroma_(rig, table),
      unseen_(rig, table, layout_, grid_),
      integral_(layout_, unseen_.cells().size()),
      pixel_rad_(pixel_side(table)) {
  centroid_overrides_.reserve(kMaxCentroidCorrections);
  offset_luminance_.resize(layout_.size());
  bilinear_samples_.resize(kMaxCentroidCorrections);
  offset_blocks_.resize(kMaxCentroidCorrections + 1);
  lens_sr_.resize(static_cast<std::size_t>(layout_.lens_count()));
  for (std::size_t block = 0; block < layout_.size(); ++block)
    lens_sr_[static_cast<std::size_t>(layout_.place(block).lens)] += grid_.solid_angle(block);
}

std::pair<std::size_t, std::size_t> SphereIntegrator::blocks_of(int lens) const {
  return {layout_.first(lens), lens + 1 < layout_.lens_count() ? layout_.first(lens + 1) : layout_.size()};
}

void SphereIntegrator::sum_codes(const RowReader& reader, std::span<const Frame> bracket,
                                 std::span<const std::uint8_t> read, double max_row_error) {
  BlockSums& blocks = integral_.blocks;
  const auto sum = [&](std::span<const std::uint8_t> of_blocks, const SampledRows& rows) {
    if (bracket.size() == 1)
      code_pass_.run(bracket[0], of_blocks, rows, blocks);
    else
      bracket_pass_.run(bracket, of_blocks, rows, blocks);
  };
  for_each_read(read, 0, blocks.sum.size(), [&](std::size_t first, std::size_t last) {
    std::fill(&blocks.row_error_of_block[first], blocks.row_error_of_block.data() + last, RowError{});
  });
  if (!(max_row_error > 0) || !row_sampling_.supports(reader)) return sum(read, {});
  const std::span<const std::uint8_t> sampled = row_sampling_.sampled(read);
  sum(row_sampling_.others(read), {});
  sum(sampled, row_sampling_.rows(reader));
  sum(row_sampling_.estimate(reader, sampled, max_row_error, blocks), {});
  // Where blocks are left out, RunRotation has the totals.
  if (read.empty()) static_cast<BlockTotals&>(blocks) = blocks.totals_of(0, blocks.sum.size());
}

const FrameIntegral& SphereIntegrator::integrate(RowReader& reader, std::span<const Frame> bracket, UnseenFill fill,
                                                 const Reading& reading) {
  FrameIntegral& out = integral_;
  unsigned present = 0;
  for (int lens = 0; lens < layout_.lens_count(); ++lens)
    if (reader.has(lens)) present |= 1U << lens;
  const bool codes = code_pass_.supports(bracket), merges = bracket_pass_.supports(bracket);
  const bool rotates = (codes || merges) && reading.interleave > 1 && present == (1U << layout_.lens_count()) - 1;
  if (!rotates || bracket.size() != exposure_count_) rotation_.restart();
  exposure_count_ = bracket.size();
  std::span<const std::uint8_t> read;
  if (rotates) read = rotation_.begin_frame(reading.interleave, bracket.front().info.mid_exposure);
  clear_missing(present);
  if (codes || merges)
    sum_codes(reader, bracket, read, reading.max_row_error);
  else
    block_pass_.run(reader, out.blocks);
  if (merges) reader.limit_exposures_per_block(layout_, out.blocks.exposures);
  const double luminance = sum_observed(present);
  out.shared_chroma = shared_chroma_.error(reader);
  out.interleaved = rotates;
  out.stale = 0;
  if (rotates) {
    for (const std::uint32_t run : rotation_.changed()) {
      const auto [begin, end, position] = rotation_.runs()[run];
      const double centroid_offset = correct_centroids(begin, end, luminance);
      rotation_.set(run, out.blocks, centroid_overrides_, centroid_offset);
    }
    const RunRotation::Sums sums = rotation_.finish_frame(out.projection);
    static_cast<BlockTotals&>(out.blocks) = sums.blocks;
    out.centroid_offset = sums.centroid_offset;
    out.stale = rotation_.stale();
  } else {
    out.centroid_offset = correct_centroids(0, layout_.size(), luminance);
  }
  out.filled = unseen_.fill(fill, present, bracket.front().info.mid_exposure, out.blocks.sum, out.unseen);
  if (!rotates) grid_.project(out.blocks.sum, centroid_overrides_, out.projection);
  if (!out.filled || out.unseen.empty()) return out;
  unseen_.cells().project(out.unseen, {}, unseen_projection_);
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.projection.c[i][k] += unseen_projection_.c[i][k];
  return out;
}

void SphereIntegrator::clear_missing(unsigned present) {
  BlockSums& blocks = integral_.blocks;
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    if ((present >> lens & 1U) != 0) continue;
    const auto [first, end] = blocks_of(lens);
    for (std::size_t block = first; block < end; ++block) {
      blocks.sum[block] = {};
      blocks.row_error_of_block[block] = {};
      for (auto* values : {&blocks.peak, &blocks.offset_x, &blocks.offset_y, &blocks.clipped, &blocks.block_noise,
                           &blocks.block_bias, &blocks.block_motion})
        (*values)[block] = 0;
    }
  }
}

double SphereIntegrator::sum_observed(unsigned present) {
  double observed_sr = 0, luminance = 0;
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    if ((present >> lens & 1U) == 0) continue;
    const auto [first, end] = blocks_of(lens);
    observed_sr += lens_sr_[static_cast<std::size_t>(lens)];
    luminance += luminance_of_all(std::span(integral_.blocks.sum).subspan(first, end - first));
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

double SphereIntegrator::correct_centroids(std::size_t begin, std::size_t end, double luminance) {
  const BlockSums& sums = integral_.blocks;
  centroid_overrides_.clear();
  if (!(luminance > 0)) return 0;
  const auto limit = static_cast<float>(kMaxCentroidError * luminance / pixel_rad_);
  for (std::size_t block = begin; block < end; ++block) {
    const float x = sums.offset_x[block], y = sums.offset_y[block];
    offset_luminance_[block] = std::max(sums.sum[block].luminance(), 0.0F) * std::sqrt(x * x + y * y);
  }
  // Four independent sums hide the latency of additions.
  double remaining4[4] = {};
  std::size_t count = 0;
  for (std::size_t block = begin; block < end; ++block) {
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
  return remaining * pixel_rad_;
}

}  // namespace lightwell::estimate
