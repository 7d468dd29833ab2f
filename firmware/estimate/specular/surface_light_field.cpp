#include "estimate/specular/surface_light_field.hpp"

#include <algorithm>
#include <bit>

#include <lightwell/pixel.hpp>

namespace lightwell::specular {
namespace {

constexpr std::size_t kFirstTable = 1U << 14U;

std::size_t slot_of(std::uint16_t tile, std::uint16_t node, std::size_t table_size) {
  // Fibonacci hashing (Knuth 1998, TAOCP vol. 3, 6.4).
  const std::uint64_t key = std::uint64_t{tile} << 16U | node;
  const int bits = std::countr_zero(table_size);
  return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> (64 - bits));
}

}  // namespace

SurfaceLightField::SurfaceLightField(const PlaneTexels& texels, int levels, std::size_t max_bytes)
    : texels_(texels),
      grid_(std::clamp(levels, 1, 127)),
      max_bytes_(std::max(max_bytes, kMinBytes)),
      head_(texels.count() / kTileTexels),
      table_(kFirstTable),
      views_(kFrames) {}

std::size_t SurfaceLightField::bytes() const {
  return blocks_.size() * kBlock * sizeof(LightFieldPage) +
         (head_.size() + table_.size() + first_.capacity()) * sizeof(std::uint32_t) + views_.size() * sizeof(View);
}

std::uint32_t SurfaceLightField::find(std::uint16_t tile, std::uint16_t node) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = slot_of(tile, node, table_.size()); table_[slot] != 0; slot = (slot + 1) & mask) {
    const LightFieldPage& candidate = page(table_[slot] - 1);
    if (candidate.node == node && candidate.tile == tile) return table_[slot];
  }
  return 0;
}

void SurfaceLightField::link(std::uint32_t index) {
  LightFieldPage& linked = page(index);
  linked.next = head_[linked.tile];
  head_[linked.tile] = index + 1;
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = slot_of(linked.tile, linked.node, table_.size());
  while (table_[slot] != 0) slot = (slot + 1) & mask;
  table_[slot] = index + 1;
}

void SurfaceLightField::grow_table() {
  table_.assign(table_.size() * 2, 0);
  std::fill(head_.begin(), head_.end(), 0U);
  for (std::uint32_t index = 0; index < page_count_; ++index) link(index);
}

void SurfaceLightField::thin() {
  std::size_t kept = 0;
  for (std::uint32_t index = 0; index < page_count_; ++index) {
    const LightFieldPage& candidate = page(index);
    // Another bit of the pattern each time, so that it halves again.
    const std::uint32_t pattern = (candidate.tile * 0x9E3779B1U + candidate.node * 0x85EBCA77U) >> 16U;
    const bool keep = newest_frame_ - candidate.frame < kKeptFrames || (pattern >> (thinned_ % 16) & 1U) != 0;
    if (keep) {
      if (kept != index) page(static_cast<std::uint32_t>(kept)) = candidate;
      ++kept;
    } else {
      const auto removed = static_cast<std::uint64_t>(std::popcount(candidate.filled));
      samples_ -= removed, removed_ += removed;
    }
  }
  for (std::size_t index = kept; index < page_count_; ++index) page(static_cast<std::uint32_t>(index)) = {};
  page_count_ = kept;
  ++thinned_;
  std::fill(table_.begin(), table_.end(), 0U);
  std::fill(head_.begin(), head_.end(), 0U);
  for (std::uint32_t index = 0; index < page_count_; ++index) link(index);
}

std::uint32_t SurfaceLightField::insert(std::uint16_t tile, std::uint16_t node) {
  if (page_count_ == blocks_.size() * kBlock) blocks_.push_back(std::make_unique<LightFieldPage[]>(kBlock));
  // At most three quarters full.
  if ((page_count_ + 1) * 4 > table_.size() * 3) grow_table();
  const auto index = static_cast<std::uint32_t>(page_count_++);
  page(index).tile = tile, page(index).node = node;
  link(index);
  return index + 1;
}

std::span<const std::uint32_t> SurfaceLightField::add(const TexelImage& image, const ViewPoint& from,
                                                      std::uint32_t frame) {
  newest_frame_ = frame;
  views_[frame % kFrames] = {vec_cast<float>(from.lens), static_cast<float>(from.pixel_rad)};
  first_.clear();
  const int tile_count = texels_.tiles() * texels_.tiles();
  // A frame adds about two pages a tile, at most as many as a tile has texels.
  const std::size_t needed = page_count_ + 4 * static_cast<std::size_t>(tile_count);
  if (needed * sizeof(LightFieldPage) + (bytes() - blocks_.size() * kBlock * sizeof(LightFieldPage)) > max_bytes_)
    thin();
  for (int tile = 0; tile < tile_count; ++tile) {
    std::uint16_t current_node = 0;
    std::uint32_t current = 0;
    for (int k = 0; k < kTileTexels; ++k) {
      const std::size_t texel = texels_.texel_of(tile, k);
      const TexelRadiance& radiance = image[texel];
      if (!radiance.measured()) continue;
      const auto node = static_cast<std::uint16_t>(grid_.nearest(vec_cast<float>(from.lens - texels_.center(texel))));
      if (current == 0 || node != current_node) {
        const auto tile_index = static_cast<std::uint16_t>(tile);
        current = find(tile_index, node);
        if (current == 0) current = insert(tile_index, node);
        current_node = node;
      }
      LightFieldPage& target = page(current - 1);
      target.frame = frame;
      const auto bit = static_cast<std::uint16_t>(1U << static_cast<unsigned>(k));
      if ((target.filled & bit) == 0) {
        target.filled = static_cast<std::uint16_t>(target.filled | bit);
        ++samples_;
        first_.push_back(static_cast<std::uint32_t>(texel));
      }
      target.sample[static_cast<std::size_t>(k)] = rgb9e5_encode(radiance.r, radiance.g, radiance.b);
    }
  }
  return first_;
}

}  // namespace lightwell::specular
