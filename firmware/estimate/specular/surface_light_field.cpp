#include "estimate/specular/surface_light_field.hpp"

#include <algorithm>
#include <bit>

#include <lightwell/pixel.hpp>

namespace lightwell::specular {
namespace {

constexpr std::size_t kFirstTable = 1U << 14U;

constexpr std::uint32_t kIndexBits = 24, kIndexMask = (1U << kIndexBits) - 1;

}  // namespace

SurfaceLightField::SurfaceLightField(const PlaneTexels& texels, int levels, std::size_t max_bytes)
    : texels_(texels),
      grid_(std::clamp(levels, 1, 127)),
      max_bytes_(std::clamp(max_bytes, kMinBytes, kMaxBytes)),
      head_(texels.count() / kTileTexels),
      table_(kFirstTable),
      codes_(static_cast<std::size_t>(texels.edge * kTileEdge)),
      nodes_(static_cast<std::size_t>(texels.tiles())),
      measured_(nodes_.size()),
      visited_(grid_.size()),
      views_(kFrames) {
  first_.reserve(texels.count());
}

SurfaceLightField::TableKey SurfaceLightField::key_of(std::uint16_t tile, std::uint16_t node) const {
  // Fibonacci hashing (Knuth 1998, TAOCP vol. 3, 6.4).
  const std::uint64_t hash = (std::uint64_t{tile} << 16U | node) * 0x9E3779B97F4A7C15ULL;
  const int rest = 64 - std::countr_zero(table_.size());
  return {static_cast<std::size_t>(hash >> rest), static_cast<std::uint32_t>(hash >> (rest - 8)) << kIndexBits};
}

std::size_t SurfaceLightField::bytes() const {
  return blocks_.size() * kBlock * sizeof(LightFieldPage) +
         (head_.size() + table_.size() + first_.capacity()) * sizeof(std::uint32_t) + views_.size() * sizeof(View);
}

std::uint32_t SurfaceLightField::find(std::uint16_t tile, std::uint16_t node) const {
  const std::size_t mask = table_.size() - 1;
  const TableKey key = key_of(tile, node);
  for (std::size_t slot = key.slot; table_[slot] != 0; slot = (slot + 1) & mask) {
    if ((table_[slot] & ~kIndexMask) != key.tag) continue;
    const std::uint32_t index = table_[slot] & kIndexMask;
    const LightFieldPage& candidate = page(index - 1);
    if (candidate.node == node && candidate.tile == tile) return index;
  }
  return 0;
}

void SurfaceLightField::link(std::uint32_t index) {
  LightFieldPage& linked = page(index);
  linked.next = head_[linked.tile];
  head_[linked.tile] = index + 1;
  const std::size_t mask = table_.size() - 1;
  const TableKey key = key_of(linked.tile, linked.node);
  std::size_t slot = key.slot;
  while (table_[slot] != 0) slot = (slot + 1) & mask;
  table_[slot] = key.tag | (index + 1);
}

void SurfaceLightField::grow_table() {
  table_.assign(table_.size() * 2, 0);
  std::fill(head_.begin(), head_.end(), 0U);
  for (std::uint32_t index = 0; index < page_count_; ++index) link(index);
}

template <class Keep>
void SurfaceLightField::remove_unless(Keep&& keep) {
  std::size_t kept = 0;
  for (std::uint32_t index = 0; index < page_count_; ++index) {
    const LightFieldPage& candidate = page(index);
    if (keep(candidate)) {
      if (kept != index) page(static_cast<std::uint32_t>(kept)) = candidate;
      ++kept;
    } else {
      samples_ -= static_cast<std::uint64_t>(std::popcount(candidate.filled));
    }
  }
  for (std::size_t index = kept; index < page_count_; ++index) page(static_cast<std::uint32_t>(index)) = {};
  page_count_ = kept;
  std::fill(table_.begin(), table_.end(), 0U);
  std::fill(head_.begin(), head_.end(), 0U);
  for (std::uint32_t index = 0; index < page_count_; ++index) link(index);
}

void SurfaceLightField::thin() {
  const std::uint64_t before = samples_;
  remove_unless([&](const LightFieldPage& candidate) {
    // Others each time: the hash (as in key_of) is of tile, node and the number of times.
    const std::uint64_t key = std::uint64_t{thinned_} << 32U | std::uint64_t{candidate.tile} << 16U | candidate.node;
    const std::uint64_t hash = key * 0x9E3779B97F4A7C15ULL;
    return newest_frame_ - candidate.frame < kKeptFrames || ((hash ^ hash >> 29U) * 0xBF58476D1CE4E5B9ULL >> 62U) != 0;
  });
  removed_ += before - samples_;
  ++thinned_;
}

void SurfaceLightField::remove_before(std::uint32_t frame) {
  std::fill(visited_.begin(), visited_.end(), std::uint8_t{0});
  remove_unless([&](const LightFieldPage& candidate) {
    const bool keep = candidate.frame >= frame;
    if (keep) visited_[candidate.node] = 1;
    return keep;
  });
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

void SurfaceLightField::store(std::uint16_t tile, std::uint16_t node, unsigned bits, const std::uint32_t* codes,
                              std::uint32_t frame) {
  std::uint32_t index = find(tile, node);
  if (index == 0) index = insert(tile, node);
  LightFieldPage& target = page(index - 1);
  target.frame = frame;
  for (unsigned k = 0; k < kTileTexels; ++k) {
    const std::uint32_t code = codes[k / kTileEdge * static_cast<unsigned>(texels_.edge) + k % kTileEdge];
    target.sample[k] = (bits >> k & 1U) != 0 ? code : target.sample[k];
  }
  for (unsigned fresh = bits & ~unsigned{target.filled}; fresh != 0; fresh &= fresh - 1)
    first_.push_back(static_cast<std::uint32_t>(texels_.texel_of(tile, std::countr_zero(fresh))));
  target.filled = static_cast<std::uint16_t>(target.filled | bits);
}

std::span<const std::uint32_t> SurfaceLightField::add(const TexelImage& image, const ViewPoint& from,
                                                      std::uint32_t frame) {
  newest_frame_ = frame;
  views_[frame % kFrames] = {vec_cast<float>(from.lens), static_cast<float>(from.pixel_rad)};
  first_.clear();
  // A frame adds at most a page a tile.
  const std::size_t needed = page_count_ + head_.size();
  if (needed * sizeof(LightFieldPage) + (bytes() - blocks_.size() * kBlock * sizeof(LightFieldPage)) > max_bytes_)
    thin();
  const auto edge = static_cast<std::size_t>(texels_.edge);
  for (int row = 0; row < texels_.tiles(); ++row) {
    const TexelRadiance* texels = &image[static_cast<std::size_t>(row * kTileEdge) * edge];
    for (std::size_t k = 0; k < codes_.size(); ++k) codes_[k] = rgb9e5_encode(texels[k].r, texels[k].g, texels[k].b);
    const auto first_tile = static_cast<std::uint16_t>(row * texels_.tiles());
    // The table and the pages are larger than caches: the row's slots are fetched first, then its pages.
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto tile = static_cast<std::uint16_t>(first_tile + i);
      nodes_[i] = static_cast<std::uint16_t>(grid_.nearest(vec_cast<float>(from.lens - texels_.tile_center(tile))));
      __builtin_prefetch(&table_[key_of(tile, nodes_[i]).slot]);
      unsigned measured = 0;
      for (unsigned k = 0; k < kTileTexels; ++k)
        measured |= (texels[k / kTileEdge * edge + i * kTileEdge + k % kTileEdge].measured() ? 1U : 0U) << k;
      measured_[i] = static_cast<std::uint16_t>(measured);
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto tile = static_cast<std::uint16_t>(first_tile + i);
      const std::uint32_t index = table_[key_of(tile, nodes_[i]).slot] & kIndexMask;
      if (index != 0) __builtin_prefetch(&page(index - 1));
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (measured_[i] != 0) {
        visited_[nodes_[i]] = 1;
        store(static_cast<std::uint16_t>(first_tile + i), nodes_[i], measured_[i], &codes_[i * kTileEdge], frame);
      }
  }
  samples_ += first_.size();
  return first_;
}

}  // namespace lightwell::specular
