#include "estimate/panorama/bright_pixels.hpp"

#include <lightwell/color.hpp>

namespace lightwell::estimate {

constexpr std::size_t kMaxBlocks = 2048;
/// In the overlap of two lenses, a pixel with less than this share of the mean solid angle is at the edge of its lens.
constexpr double kMinOverlapShare = 0.1;

BrightPixels::BrightPixels(const RigTable& table, const BlockLayout& layout)
    : table_(table),
      layout_(layout),
      max_blocks_(std::min(kMaxBlocks, layout.size())),
      mean_sr_(pixel_side(table) * pixel_side(table)),
      min_overlap_solid_angle_(static_cast<float>(kMinOverlapShare * mean_sr_)),
      slot_of_block_(layout.size(), -1),
      row_(max_image_width(table)) {
  Id pixels = 0;
  for (const LensTable& lens : table.lenses) {
    lens_first_.push_back(pixels);
    pixels += static_cast<Id>(lens.width) * static_cast<Id>(lens.height);
  }
  lens_first_.push_back(pixels);
  blocks_.reserve(max_blocks_);
  rows_.reserve(max_blocks_);
  pool_.resize(max_blocks_ << 2 * layout.shift());
}

void BrightPixels::clear() {
  for (const std::uint32_t block : blocks_) slot_of_block_[block] = -1;
  blocks_.clear();
  rows_.clear();
}

std::int32_t BrightPixels::new_slot(std::size_t block) {
  const auto slot = static_cast<std::int32_t>(blocks_.size());
  slot_of_block_[block] = slot;
  blocks_.push_back(static_cast<std::uint32_t>(block));
  rows_.push_back(0);
  return slot;
}

void BrightPixels::read(RowReader& reader, std::size_t block) {
  const std::int32_t slot = slot_for(block);
  if (slot < 0) return;
  // The rows are far apart in large tables: all are prefetched before the first is used.
  const BlockLayout::Place& p = layout_.place(block);
  const LensTable& table = lens({p.lens, 0, 0});
  for (int y = p.y; y < p.y + p.height; ++y) {
    __builtin_prefetch(&table.solid_angle[index({p.lens, p.x, y})]);
    __builtin_prefetch(&table.inverse_vignetting[index({p.lens, p.x, y})]);
  }
  for (int row = 0; row < p.height; ++row)
    if ((rows_[static_cast<std::size_t>(slot)] >> row & 1U) == 0) read_row(reader, slot, row);
}

void BrightPixels::read_row(RowReader& reader, std::int32_t slot, int row) {
  const auto number = static_cast<std::size_t>(slot);
  rows_[number] |= std::uint64_t{1} << row;
  const BlockLayout::Place p = layout_.place(blocks_[number]);
  Light* out = &pool_[(number << layout_.shift() | static_cast<std::size_t>(row)) << layout_.shift()];
  ReadStatistics ignored;  // The pass over all pixels has counted them.
  reader.read(p.lens, p.y + row, p.x, p.x + p.width, RowReader::Reading::radiance, row_, ignored);
  const float* solid_angle = &lens({p.lens, 0, 0}).solid_angle[index({p.lens, p.x, p.y + row})];
  for (std::size_t i = 0; i < static_cast<std::size_t>(p.width); ++i)
    out[i] = solid_angle[i] > 0 ? Light{row_.r[i], row_.g[i], row_.b[i], luminance_of(row_.r[i], row_.g[i], row_.b[i])}
                                : Light{};
}

bool BrightPixels::at_edge(Place p) const {
  const LensTable& own = lens(p);
  return !own.overlap_pixel.empty() && own.overlap_pixel[index(p)] >= 0 &&
         own.solid_angle[index(p)] < min_overlap_solid_angle_;
}

BlockFloodFill::BlockFloodFill(const RigTable& table, const BlockLayout& layout, const CellGrid& grid,
                               const BrightPixels& pixels)
    : grid_(grid), mark_(layout.size()) {
  blocks_.reserve(kMaxBlocks + 1);
  std::vector<std::uint32_t> neighbours;
  for (std::size_t block = 0; block < layout.size(); ++block) {
    first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
    const BlockLayout::Place p = layout.place(block);
    const LensTable& lens = table.lenses[static_cast<std::size_t>(p.lens)];
    neighbours.clear();
    BlockLayout::for_each_pixel(p, lens, [&](int x, int y, std::size_t i) {
      const bool rim = x == 0 || y == 0 || x == p.width - 1 || y == p.height - 1;
      if (!rim && (lens.overlap_pixel.empty() || lens.overlap_pixel[i] < 0)) return;
      pixels.for_each_neighbour({p.lens, p.x + x, p.y + y}, [&](BrightPixels::Place n, BrightPixels::Id) {
        const auto other = static_cast<std::uint32_t>(layout.block_of(n.lens, n.x, n.y));
        // Blocks without solid angle contain no light and are no background.
        if (other != block && grid.solid_angle(other) > 0 &&
            std::find(neighbours.begin(), neighbours.end(), other) == neighbours.end())
          neighbours.push_back(other);
      });
    });
    neighbours_.insert(neighbours_.end(), neighbours.begin(), neighbours.end());
  }
  first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
}

}  // namespace lightwell::estimate
