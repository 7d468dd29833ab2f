// The surface light field of a plane: for each texel one sample of radiance for each discrete viewing direction that
// was seen, and nothing for the others (Jachnik et al. 2012, section 4; Wood et al. 2000, "Surface Light Fields for 3D
// Photography").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/hemisphere_grid.hpp>

#include "estimate/specular/plane_texels.hpp"

namespace lightwell::specular {

/// The samples of one tile of texels for one node of the hemisphere.
struct LightFieldPage {
  std::uint32_t next = 0;                           ///< Index of the next page of the same tile, plus one; 0: the last.
  std::uint32_t frame = 0;                          ///< Number of the frame that was written last.
  std::uint16_t tile = 0;                           ///< Row by row.
  std::uint16_t node = 0;                           ///< Of the hemisphere.
  std::uint16_t filled = 0;                         ///< Bit k: texel k of the tile, row by row, has a sample.
  std::array<std::uint32_t, kTileTexels> sample{};  ///< RGB9E5.
};

/// From where a frame was taken.
struct ViewPoint {
  Vec3d lens;            ///< Position of the lens in the plane's frame, m; z > 0.
  double pixel_rad = 0;  ///< Angle between neighbouring pixels.
};

/// Storage is sparse in texels and in directions. A frame's texels are stored by tile: the direction of a tile is that
/// of its centre (0.2 degrees from its corners at 0.4 m and 0.8 mm texels), so that a page is filled by one frame, and
/// view_of() gives the directions of its texels exactly. Memory: 80 bytes a page and its share of a hash table. Pages
/// are allocated in blocks that never move. Where memory ends, a quarter of the older pages is removed: all directions
/// keep samples of most tiles, and all texels those of most of their directions.
class SurfaceLightField {
 public:
  /// `levels` of the hemisphere: at most 127. `max_bytes`: kMinBytes to kMaxBytes; both are clamped.
  SurfaceLightField(const PlaneTexels& texels, int levels, std::size_t max_bytes);

  [[nodiscard]] const HemisphereGrid& grid() const { return grid_; }
  [[nodiscard]] const PlaneTexels& texels() const { return texels_; }

  /// Stores the texels of a frame that are measured; a newer sample replaces an older one. `frame` must not decrease.
  /// Returns the texels whose sample is the first one in its direction; valid until the next call.
  std::span<const std::uint32_t> add(const TexelImage& image, const ViewPoint& from, std::uint32_t frame);

  /// Calls `visit(const LightFieldPage&)` for all pages of a tile, newest first.
  template <class Visit>
  void for_each_page(int tile, Visit&& visit) const {
    for (std::uint32_t at = head_[static_cast<std::size_t>(tile)]; at != 0; at = page(at - 1).next) visit(page(at - 1));
  }

  /// As ViewPoint, in floats.
  struct View {
    Vec3f lens;
    float pixel_rad = 0;
  };
  /// From where a frame was taken; nullptr where it is older than kFrames.
  [[nodiscard]] const View* view_of(std::uint32_t frame) const {
    return newest_frame_ - frame < kFrames ? &views_[frame % kFrames] : nullptr;
  }

  /// Removes the pages whose last sample is of an earlier frame: the light has changed since.
  void remove_before(std::uint32_t frame);

  /// By node: 1 where a sample was stored since the last remove_before(), also if memory ended since.
  [[nodiscard]] std::span<const std::uint8_t> visited() const { return visited_; }
  [[nodiscard]] std::size_t pages() const { return page_count_; }
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  /// Share of texels and directions that have a sample.
  [[nodiscard]] double fill() const {
    return static_cast<double>(samples_) / (static_cast<double>(texels_.count()) * static_cast<double>(grid_.size()));
  }
  [[nodiscard]] std::size_t bytes() const;
  /// Samples that were removed because of `max_bytes`.
  [[nodiscard]] std::uint64_t removed() const { return removed_; }

  static constexpr std::uint32_t kFrames = 1U << 16U;
  /// Memory for the pages of a few frames.
  static constexpr std::size_t kMinBytes = 16U << 20U;
  /// Pages have indices of 24 bits.
  static constexpr std::size_t kMaxBytes = 1280U << 20U;

 private:
  static constexpr std::size_t kBlock = 4096;      ///< Pages of a block.
  static constexpr std::uint32_t kKeptFrames = 8;  ///< The separation may not have seen them yet.

  [[nodiscard]] const LightFieldPage& page(std::uint32_t index) const {
    return blocks_[index / kBlock][index % kBlock];
  }
  [[nodiscard]] LightFieldPage& page(std::uint32_t index) { return blocks_[index / kBlock][index % kBlock]; }
  /// Where a page is in the table: its slot, and the tag of its entry.
  struct TableKey {
    std::size_t slot = 0;
    std::uint32_t tag = 0;
  };
  [[nodiscard]] TableKey key_of(std::uint16_t tile, std::uint16_t node) const;
  /// Index of the page, plus one; 0 where it is not stored.
  [[nodiscard]] std::uint32_t find(std::uint16_t tile, std::uint16_t node) const;
  /// Index of a new page, plus one.
  [[nodiscard]] std::uint32_t insert(std::uint16_t tile, std::uint16_t node);
  /// Stores the texels of a tile; `bits` as in LightFieldPage::filled, `codes`: of the tile's first texel.
  void store(std::uint16_t tile, std::uint16_t node, unsigned bits, const std::uint32_t* codes, std::uint32_t frame);
  void grow_table();
  /// Links a page into its tile's list and the table.
  void link(std::uint32_t index);
  /// Removes a quarter of the pages that are older than kKeptFrames, by a hash of tile and direction.
  void thin();
  template <class Keep>
  void remove_unless(Keep&& keep);

  PlaneTexels texels_;
  HemisphereGrid grid_;
  std::size_t max_bytes_;
  std::vector<std::unique_ptr<LightFieldPage[]>> blocks_;
  std::size_t page_count_ = 0;
  std::vector<std::uint32_t> head_;  ///< By tile: index of its newest page, plus one.
  /// Open addressing. Index of a page, plus one, in the lower 24 bits, above it a tag: 8 more bits of the hash, by
  /// which nearly all other pages are skipped without reading them. 0: empty.
  std::vector<std::uint32_t> table_;
  std::vector<std::uint32_t> first_;  ///< Result of add().
  // Memory of add(), for a row of tiles: RGB9E5 by texel, row by row; by tile its node and the texels that are
  // measured.
  std::vector<std::uint32_t> codes_;
  std::vector<std::uint16_t> nodes_, measured_;
  std::vector<std::uint8_t> visited_;
  std::vector<View> views_;  ///< By frame modulo kFrames.
  std::uint32_t newest_frame_ = 0;
  std::uint64_t samples_ = 0, removed_ = 0;
  std::uint32_t thinned_ = 0;  ///< Times.
};

}  // namespace lightwell::specular
