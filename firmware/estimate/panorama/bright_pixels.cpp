#include "estimate/panorama/bright_pixels.hpp"

#include <algorithm>
#include <lightwell/color.hpp>

namespace lightwell::estimate {
namespace {

constexpr std::size_t kMostBlocks = 2048;
/// Of a direction that two lenses see, one that has less than this share of a pixel is at its edge, where a pixel sees but
/// a part of itself: the other lens tells it.
constexpr double kLeastShare = 0.1;

}  // namespace

BrightPixels::BrightPixels(const RigTable& table, const BlockLayout& layout)
    : table_(table),
      layout_(layout),
      most_blocks_(std::min(kMostBlocks, layout.size())),
      mean_sr_(pixel_side(table) * pixel_side(table)),
      least_of_twins_(static_cast<float>(kLeastShare * mean_sr_)),
      slot_of_block_(layout.size(), -1),
      row_(widest(table)) {
  Id pixels = 0;
  for (const LensTable& lens : table.lenses) {
    lens_first_.push_back(pixels);
    pixels += static_cast<Id>(lens.width) * static_cast<Id>(lens.height);
  }
  lens_first_.push_back(pixels);
  blocks_.reserve(most_blocks_);
  pool_.resize(most_blocks_ << 2 * layout.shift());
}

void BrightPixels::forget() {
  for (const std::uint32_t block : blocks_) slot_of_block_[block] = -1;
  blocks_.clear();
}

void BrightPixels::read(RowReader& reader, std::size_t block) {
  if (has(block) || blocks_.size() >= most_blocks_) return;
  Light* out = &pool_[blocks_.size() << 2 * layout_.shift()];
  slot_of_block_[block] = static_cast<std::int32_t>(blocks_.size());
  blocks_.push_back(static_cast<std::uint32_t>(block));
  const BlockLayout::Place p = layout_.place(block);
  ReadingCounts ignored;  // The pass over all pixels has counted these already.
  for (int y = 0; y < p.height; ++y, out += layout_.edge()) {
    reader.read(p.lens, p.y + y, p.x, p.x + p.width, RowReader::Reading::radiance, row_, ignored);
    const float* solid_angle = &lens({p.lens, 0, 0}).solid_angle[index({p.lens, p.x, p.y + y})];
    for (std::size_t i = 0; i < static_cast<std::size_t>(p.width); ++i)
      out[i] = solid_angle[i] > 0 ? Light{row_.r[i], row_.g[i], row_.b[i], luminance_of(row_.r[i], row_.g[i], row_.b[i])}
                                  : Light{};
  }
}

const BrightPixels::Light* BrightPixels::light(RowReader& reader, Place p) {
  const std::size_t block = layout_.block_of(p.lens, p.x, p.y);
  if (!has(block)) read(reader, block);
  return has(block) ? &light(p) : nullptr;
}

bool BrightPixels::at_edge(Place p) const {
  const LensTable& own = lens(p);
  return !own.twin.empty() && own.twin[index(p)] >= 0 && own.solid_angle[index(p)] < least_of_twins_;
}

}  // namespace lightwell::estimate
