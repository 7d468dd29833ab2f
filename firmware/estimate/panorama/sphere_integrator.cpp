#include "estimate/panorama/sphere_integrator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::estimate {
namespace {

/// Largest error without centroid correction: luminance of a cell times the centroid's offset, rad, relative to the
/// luminance of all cells.
constexpr double kMaxCentroidError = 2e-6;
constexpr std::size_t kMaxCentroidCorrections = 4096;
/// A light is required where its peak luminance exceeds the mean by this factor.
constexpr float kMinPeakRatio = 100;

}  // namespace

SphereIntegrator::SphereIntegrator(const RigParameters& rig, const RigTable& table, int edge)
    : table_(table),
      layout_(table, edge),
      grid_(layout_.make_grid(table)),
      block_pass_(table, layout_),
      code_pass_(rig, table, layout_),
      bracket_pass_(rig, table, layout_, block_pass_),
      sums_(layout_),
      unseen_(rig, table, layout_, grid_),
      finder_(table, layout_, grid_, sums_),
      pixel_rad_(pixel_side(table)) {
  centroid_overrides_.reserve(kMaxCentroidCorrections);
  offset_luminance_.resize(layout_.size());
  bilinear_samples_.resize(kMaxCentroidCorrections);
  offset_blocks_.resize(kMaxCentroidCorrections + 1);
}

void SphereIntegrator::integrate(RowReader& reader, std::span<const Frame> bracket, const EstimatorConfig& config,
                                 FrameIntegral& out) {
  if (code_pass_.supports(bracket)) {
    code_pass_.run(bracket[0], sums_);
  } else if (bracket_pass_.supports(bracket)) {
    bracket_pass_.run(bracket, sums_);
    reader.limit_exposures_per_block(layout_, sums_.exposures);
  } else {
    block_pass_.run(reader, sums_);
  }
  unsigned present = 0;
  out.observed_sr = 0;
  double luminance = 0;
  float peak = 0;
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    const std::size_t first = layout_.first(lens);
    const std::size_t end = lens + 1 < layout_.lens_count() ? layout_.first(lens + 1) : layout_.size();
    if (reader.has(lens)) present |= 1U << lens;
    for (std::size_t block = first; block < end; ++block) {
      if (!reader.has(lens)) {
        sums_.sum[block] = {};
        sums_.peak[block] = sums_.offset_x[block] = sums_.offset_y[block] = 0;
        continue;
      }
      out.observed_sr += grid_.solid_angle(block);
      luminance += sums_.sum[block].luminance();
      peak = std::max(peak, sums_.peak[block]);
    }
  }
  const auto mean = static_cast<float>(luminance / std::max(out.observed_sr, 1e-12));
  out.lights.clear();
  out.required_light = -1;
  if (const std::optional<Light> brightest = finder_.find_brightest(reader, mean, config)) {
    out.lights.push_back(*brightest);
    if (peak > kMinPeakRatio * mean) out.required_light = 0;
  }
  out.chroma_edge_error = finder_.chroma_edge_error();
  correct_centroids(luminance, out);
  out.filled = unseen_.fill(config.panorama.unseen, present, bracket.front().info.mid_exposure, sums_.sum);
  grid_.project(sums_.sum, centroid_overrides_, out.projection);
  if (!out.filled || unseen_.cells().size() == 0) return;
  unseen_.cells().project(unseen_.sums(), {}, unseen_projection_);
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.projection.c[i][k] += unseen_projection_.c[i][k];
}

void SphereIntegrator::find_lights(RowReader& reader, int most, FrameIntegral& out) {
  const int brightest = finder_.find_more(reader, most, out.lights);
  if (out.required_light >= 0) out.required_light = brightest;
  out.chroma_edge_error = finder_.chroma_edge_error();
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

void SphereIntegrator::residual_cell_sums(std::span<const std::size_t> without, std::vector<CellSum>& out) const {
  out.assign(sums_.sum.begin(), sums_.sum.end());
  for (const std::size_t k : without) finder_.subtract(k, out);
  out.insert(out.end(), unseen_.sums().begin(), unseen_.sums().end());
}

void SphereIntegrator::row_profile(int lens, std::vector<float>& out) const {
  out.clear();
  const int height = table_.lenses[static_cast<std::size_t>(lens)].height, columns = layout_.columns(lens);
  for (int top = 0; top < height; top += layout_.edge()) {
    const std::size_t first = layout_.block_of(lens, 0, top);
    float luminance = 0, solid_angle = 0, clipped = 0;
    for (std::size_t block = first; block < first + static_cast<std::size_t>(columns); ++block) {
      luminance += sums_.sum[block].luminance();
      solid_angle += grid_.solid_angle(block);
      clipped += sums_.clipped[block];
    }
    const bool usable = solid_angle > 0 && clipped == 0;
    out.push_back(usable ? luminance / solid_angle : std::numeric_limits<float>::quiet_NaN());
  }
}

SphereIntegrator::BilinearSample SphereIntegrator::bilinear_sample_of(std::size_t block) const {
  const BlockLayout::Place p = layout_.place(block);
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
  const BlockPass::Middle middle = block_pass_.middle(block);
  const float x = std::clamp(middle.x + sums_.offset_x[block], 0.0F, static_cast<float>(p.width - 1));
  const float y = std::clamp(middle.y + sums_.offset_y[block], 0.0F, static_cast<float>(p.height - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(p.width - 2, 0)),
            y0 = std::min(static_cast<int>(y), std::max(p.height - 2, 0));
  const Vec3f* at = &lens.direction[static_cast<std::size_t>(p.y + y0) * static_cast<std::size_t>(lens.width) +
                                    static_cast<std::size_t>(p.x + x0)];
  return {at, p.width > 1 ? 1 : 0, p.height > 1 ? lens.width : 0, x - static_cast<float>(x0),
          y - static_cast<float>(y0)};
}

Vec3d SphereIntegrator::direction_at(const BilinearSample& sample) {
  const auto interpolate = [](Vec3f a, Vec3f b, float fraction) { return a * (1 - fraction) + b * fraction; };
  const Vec3f upper = interpolate(sample.at[0], sample.at[sample.right], sample.x),
              lower = interpolate(sample.at[sample.down], sample.at[sample.down + sample.right], sample.x);
  return normalized(vec_cast<double>(interpolate(upper, lower, sample.y)));
}

void SphereIntegrator::correct_centroids(double luminance, FrameIntegral& out) {
  centroid_overrides_.clear();
  out.centroid_offset = 0;
  if (!(luminance > 0)) return;
  const auto limit = static_cast<float>(kMaxCentroidError * luminance / pixel_rad_);
  const std::size_t blocks = sums_.sum.size();
  for (std::size_t block = 0; block < blocks; ++block) {
    const float x = sums_.offset_x[block], y = sums_.offset_y[block];
    offset_luminance_[block] = std::max(sums_.sum[block].luminance(), 0.0F) * std::sqrt(x * x + y * y);
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
  out.centroid_offset = remaining * pixel_rad_;
}

}  // namespace lightwell::estimate
