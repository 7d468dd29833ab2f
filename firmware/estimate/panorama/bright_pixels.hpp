// Bright blocks: cache of their pixels, adjacency of pixels on the sphere, and flood fill over blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Pixels of bright blocks, each read once per frame.
class BrightPixels {
 public:
  using Id = std::uint32_t;  ///< Index of a pixel over all lenses.
  struct Place {
    int lens, x, y;
  };
  struct Light {
    float r, g, b, luminance;
  };
  struct Pixel {
    Place place;
    Id id;
    Light light;
  };

  /// Refers to both arguments.
  BrightPixels(const RigTable& table, const BlockLayout& layout);

  /// Number of pixels of all lenses.
  [[nodiscard]] std::size_t size() const { return lens_first_.back(); }
  /// Largest number of blocks that can be read per frame.
  [[nodiscard]] std::size_t max_blocks() const { return max_blocks_; }
  /// Mean solid angle of a pixel, sr.
  [[nodiscard]] double mean_solid_angle() const { return mean_sr_; }

  /// Must be called before each frame.
  void clear();
  /// Reads all pixels of a block, unless memory is exhausted.
  void read(RowReader& reader, std::size_t block);
  /// Whether any row of the block was read.
  [[nodiscard]] bool has(std::size_t block) const { return slot_of_block_[block] >= 0; }

  /// Light of a pixel that has been read. The pixels to its right in the same block follow in memory.
  [[nodiscard]] const Light& light(Place p) const { return at(slot_of_block_[layout_.block_of(p.lens, p.x, p.y)], p); }
  /// Light of a pixel of `block`; reads its row if necessary. Null where memory is exhausted.
  [[nodiscard]] const Light* light(RowReader& reader, std::size_t block, Place p) {
    const std::int32_t slot = slot_for(block);
    if (slot < 0) return nullptr;
    const int row = p.y & (layout_.edge() - 1);
    if ((rows_[static_cast<std::size_t>(slot)] >> row & 1U) == 0) read_row(reader, slot, row);
    return &at(slot, p);
  }

  [[nodiscard]] Id id(Place p) const {
    return lens_first_[static_cast<std::size_t>(p.lens)] + static_cast<Id>(index(p));
  }
  [[nodiscard]] Vec3f direction(const Pixel& pixel) const {
    return lens(pixel.place).direction[pixel.id - lens_first_[static_cast<std::size_t>(pixel.place.lens)]];
  }
  [[nodiscard]] float solid_angle(const Pixel& pixel) const {
    return lens(pixel.place).solid_angle[pixel.id - lens_first_[static_cast<std::size_t>(pixel.place.lens)]];
  }
  /// Whether the pixel is at the edge of its lens and another sees it, too: its light is used, not its position.
  [[nodiscard]] bool at_edge(Place place) const;

  /// Calls `visit(place, id)` for the eight neighbours, across seam and poles, and for the nine pixels of the other
  /// lens around the one with the same direction, because the brightest pixels may differ.
  template <class Visit>
  void for_each_neighbour(Place p, Visit&& visit) const;

 private:
  /// Slot of the block in pool_, allocated if necessary; negative where memory is exhausted.
  [[nodiscard]] std::int32_t slot_for(std::size_t block) {
    const std::int32_t slot = slot_of_block_[block];
    return slot >= 0 || blocks_.size() >= max_blocks_ ? slot : new_slot(block);
  }
  std::int32_t new_slot(std::size_t block);
  void read_row(RowReader& reader, std::int32_t slot, int row);
  [[nodiscard]] const Light& at(std::int32_t slot, Place p) const {
    const int mask = layout_.edge() - 1, shift = layout_.shift();
    return pool_[static_cast<std::size_t>(((slot << shift | (p.y & mask)) << shift) | (p.x & mask))];
  }
  [[nodiscard]] const LensTable& lens(Place p) const { return table_.lenses[static_cast<std::size_t>(p.lens)]; }
  /// Index of the pixel in its lens.
  [[nodiscard]] std::size_t index(Place p) const { return lens(p).index(p.x, p.y); }

  const RigTable& table_;
  const BlockLayout& layout_;
  std::size_t max_blocks_;
  double mean_sr_;
  float min_overlap_solid_angle_;
  std::vector<Id> lens_first_;
  std::vector<std::int32_t> slot_of_block_;
  std::vector<std::uint32_t> blocks_;  ///< By slot, the block.
  std::vector<std::uint64_t> rows_;    ///< By slot, a bit mask of the rows that were read.
  std::vector<Light> pool_;            ///< edge² elements per slot.
  LinearRow row_;
};

template <class Visit>
void BrightPixels::for_each_neighbour(Place p, Visit&& visit) const {
  const LensTable& own = lens(p);
  const bool inside = p.x > 0 && p.y > 0 && p.x + 1 < own.width && p.y + 1 < own.height;
  for (int dy = -1; dy <= 1; ++dy) {
    if (inside) {
      const Id middle = id({p.lens, p.x, p.y + dy});
      visit(Place{p.lens, p.x - 1, p.y + dy}, middle - 1);
      if (dy != 0) visit(Place{p.lens, p.x, p.y + dy}, middle);
      visit(Place{p.lens, p.x + 1, p.y + dy}, middle + 1);
      continue;
    }
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      int x = p.x + dx, y = p.y + dy;
      if (own.equirectangular) {
        if (y < 0 || y >= own.height) {
          // The neighbour across the pole is in the same row, 180 degrees away.
          y = p.y;
          x += own.width / 2;
        }
        x = (x % own.width + own.width) % own.width;
      } else if (x < 0 || y < 0 || x >= own.width || y >= own.height) {
        continue;
      }
      const Place there{p.lens, x, y};
      visit(there, id(there));
    }
  }
  if (own.overlap_pixel.empty()) return;
  const std::int32_t pixel = own.overlap_pixel[index(p)];
  if (pixel < 0) return;
  const int other = 1 - p.lens;
  const LensTable& there = table_.lenses[static_cast<std::size_t>(other)];
  const int x = pixel % there.width, y = pixel / there.width;
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, there.height - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, there.width - 1); ++i)
      visit(Place{other, i, j}, id({other, i, j}));
}

/// Flood fill over bright blocks, across seams, poles and lenses.
class BlockFloodFill {
 public:
  /// Value of `cos_reach` without a limit.
  static constexpr float kUnlimitedReach = -2;
  /// Largest number of blocks of a run.
  static constexpr std::size_t kMaxBlocks = 4096;

  /// Refers to `grid`. `pixels` is used in the constructor alone, for the adjacency of pixels.
  BlockFloodFill(const RigTable& table, const BlockLayout& layout, const CellGrid& grid, const BrightPixels& pixels);

  /// Fills blocks() with the blocks connected to `block` (first itself) whose peak luminance is at least `floor`, whose
  /// middle is within `cos_reach` of `axis`, and for which excluded(block) is false. Returns the integral of their
  /// luminance above the mean luminance of the darkest adjacent block.
  template <class Excluded>
  double run(const BlockSums& sums, std::uint32_t block, float floor, Vec3f axis, float cos_reach, Excluded&& excluded);

  /// Blocks of the last run.
  [[nodiscard]] std::span<const std::uint32_t> blocks() const { return blocks_; }
  [[nodiscard]] bool has(std::size_t block) const { return mark_[block] == run_; }
  /// Blocks with solid angle that touch a block.
  [[nodiscard]] std::span<const std::uint32_t> neighbours(std::size_t block) const {
    return std::span(neighbours_)
        .subspan(first_neighbour_[block], first_neighbour_[block + 1] - first_neighbour_[block]);
  }

 private:
  const CellGrid& grid_;
  /// Neighbours of block b: neighbours_[first_neighbour_[b]] to neighbours_[first_neighbour_[b + 1] - 1].
  std::vector<std::uint32_t> first_neighbour_, neighbours_;
  std::vector<std::uint32_t> blocks_;
  std::vector<std::uint32_t> mark_;  ///< By block, the last run that contains it.
  std::uint32_t run_ = 0;
};

template <class Excluded>
double BlockFloodFill::run(const BlockSums& sums, std::uint32_t block, float floor, Vec3f axis, float cos_reach,
                           Excluded&& excluded) {
  ++run_;
  blocks_.assign(1, block);
  mark_[block] = run_;
  double luminance = 0, sr = 0;
  float darkest = std::numeric_limits<float>::infinity();
  for (std::size_t next = 0; next < blocks_.size(); ++next) {
    const std::uint32_t at = blocks_[next];
    luminance += std::max(0.0F, sums.sum[at].luminance());
    sr += grid_.solid_angle(at);
    for (std::uint32_t i = first_neighbour_[at]; i < first_neighbour_[at + 1]; ++i) {
      const std::uint32_t other = neighbours_[i];
      if (!(sums.peak[other] >= floor)) {
        darkest = std::min(darkest, sums.sum[other].luminance() / grid_.solid_angle(other));
        continue;
      }
      if (mark_[other] == run_ || excluded(other)) continue;
      if (dot(grid_.direction(other), axis) < cos_reach || blocks_.size() >= kMaxBlocks) continue;
      mark_[other] = run_;
      blocks_.push_back(other);
    }
  }
  return std::isfinite(darkest) ? std::max(0.0, luminance - std::max(0.0, static_cast<double>(darkest)) * sr)
                                : luminance;
}

}  // namespace lightwell::estimate
