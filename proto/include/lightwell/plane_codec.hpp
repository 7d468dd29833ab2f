// Encoding and decoding of captured planes, in tiles. Specification: proto/README.md, "Captured planes".
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <lightwell/captured_plane.hpp>

namespace lightwell {

inline constexpr std::uint32_t kPlaneWireVersion = 1;
/// A longer message is neither written nor decoded.
inline constexpr std::size_t kMaxPlaneMessageBytes = 64 * 1024;

enum class PlanePart : std::uint8_t { texture, lumisphere, coverage };

/// How the entries (texels, nodes) of a plane are divided into tiles, and the order of the tiles: those of the texture,
/// row by row from the top, then those of the lumisphere, then those of the coverage.
class PlaneTileLayout {
 public:
  static constexpr int kTextureTileEdge = 32;
  static constexpr std::size_t kLumisphereTileNodes = 1024, kCoverageTileNodes = 8192;

  PlaneTileLayout() = default;
  /// Sizes within the limits of captured_plane.hpp.
  PlaneTileLayout(int texture_edge, int lumisphere_levels, int coverage_levels);

  [[nodiscard]] int texture_edge() const { return edge_; }
  [[nodiscard]] int lumisphere_levels() const { return lumisphere_levels_; }
  [[nodiscard]] int coverage_levels() const { return coverage_levels_; }

  /// Number of tiles.
  [[nodiscard]] std::size_t size() const { return texture_tiles() + lumisphere_tiles() + coverage_tiles(); }
  [[nodiscard]] PlanePart part(std::size_t tile) const;
  /// Number of entries of a tile.
  [[nodiscard]] std::size_t entries(std::size_t tile) const;
  /// Index of entry k of a tile in the arrays of its part. Of the texture: row by row within the tile.
  [[nodiscard]] std::size_t entry(std::size_t tile, std::size_t k) const;
  /// The tile that holds this entry.
  [[nodiscard]] std::size_t tile_of(PlanePart part, std::size_t entry) const;

  friend bool operator==(const PlaneTileLayout&, const PlaneTileLayout&) = default;

 private:
  [[nodiscard]] std::size_t across() const {
    return static_cast<std::size_t>((edge_ + kTextureTileEdge - 1) / kTextureTileEdge);
  }
  [[nodiscard]] std::size_t texture_tiles() const { return across() * across(); }
  [[nodiscard]] std::size_t lumisphere_tiles() const {
    return (HemisphereGrid(lumisphere_levels_).size() + kLumisphereTileNodes - 1) / kLumisphereTileNodes;
  }
  [[nodiscard]] std::size_t coverage_tiles() const {
    return (HemisphereGrid(coverage_levels_).size() + kCoverageTileNodes - 1) / kCoverageTileNodes;
  }
  /// Width and height of a tile of the texture.
  [[nodiscard]] std::size_t columns(std::size_t tile) const;
  [[nodiscard]] std::size_t rows(std::size_t tile) const;

  int edge_ = 0, lumisphere_levels_ = 1, coverage_levels_ = 1;
};

/// The whole content of one tile.
struct PlaneTile {
  std::size_t index = 0;
  std::vector<Radiance> radiance;  ///< By entry; empty in a tile of the coverage.
  std::vector<SampleState> state;  ///< By entry; of the coverage: measured where seen.
};

/// One message. Tiles of revision 0 were never sent: all their entries are unseen and zero.
struct PlaneUpdate {
  PlaneInfo info;
  std::uint64_t revision = 0;  ///< Of the update, from 1.
  Duration key_interval;       ///< Every tile with content is repeated at least so often.
  PlaneTileLayout layout;
  std::vector<std::uint64_t> tile_revision;  ///< By tile: the update in which its content last changed.
  std::vector<PlaneTile> tiles;
};

/// data_loss for bytes that are not a message or are too long, invalid_argument, naming the field, for a message that
/// violates the specification. Unknown fields are ignored. Needs at most a few megabytes, whatever the bytes are.
[[nodiscard]] Result<PlaneUpdate> decode_plane_update(std::span<const std::byte> bytes);

/// Who may receive images. The texture of a plane is a photograph.
enum class ImageRecipients : std::uint8_t { nobody, all_clients };

struct PlaneEncoderOptions {
  ImageRecipients images = ImageRecipients::nobody;  ///< nobody: no message has a texel.
  /// A tile is sent again when a channel of an entry differs from what was sent by more than this times the entry's
  /// largest channel, at least kMinRelativeEntry times the tile's; and when a state differs. At least 1/256, which is
  /// above the rounding error of RGB9E5.
  float step = 1.0F / 64;
  /// Every tile is repeated at least so often, for readers that joined later or lost a message. 1 ms to 1000 s.
  Duration key_interval{10'000'000'000};
};

/// Encodes successive states of a plane for one stream of messages: remembers what was sent, and writes the tiles that
/// changed. One thread at a time. Reuses its memory.
class PlaneEncoder {
 public:
  static constexpr float kMinRelativeEntry = 1e-3F;

  explicit PlaneEncoder(const PlaneEncoderOptions& options = {});
  ~PlaneEncoder();
  PlaneEncoder(PlaneEncoder&&) noexcept;
  PlaneEncoder& operator=(PlaneEncoder&&) noexcept;

  /// The messages of one update, one or more, each complete in itself: they may be lost or reordered. Valid until the
  /// next call. Without a change it is one message without tiles. Negative radiance is sent as 0. Time is that of the
  /// plane's mid_exposure. invalid_argument as captured_plane_problem(); failed_precondition if the sizes differ from
  /// those of the previous call with the same capture number. Then nothing changes.
  [[nodiscard]] Result<std::span<const std::vector<std::byte>>> encode(const CapturedPlane& plane);

  /// All that was sent so far, as messages of the newest update: for a reader that joins now, which then holds what the
  /// readers of all messages hold. None before the first encode(). Valid until the next call.
  [[nodiscard]] std::span<const std::vector<std::byte>> whole();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightwell
