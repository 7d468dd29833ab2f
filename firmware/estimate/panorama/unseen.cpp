#include "estimate/panorama/unseen.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/fibonacci_lattice.hpp>

namespace lightwell::estimate {
namespace {

/// Number of cells over the whole sphere, about 4 degrees wide: the filling is not more precise than that.
constexpr int kCells = 2562;
/// Time constant of the mean.
constexpr double kMeanTimeConstant_s = 2;
constexpr unsigned kAllLenses = (1U << kMaxLenses) - 1;

Vec3d mirrored(Vec3d d, Vec3d axis) { return d - axis * (2 * dot(d, axis)); }

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

}  // namespace lightwell::estimate
