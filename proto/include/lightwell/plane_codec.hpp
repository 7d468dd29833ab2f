// Encoding and decoding of captured planes, in tiles. Specification: proto/README.md, "Captured planes".
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/plane_tiles.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

inline constexpr std::uint32_t kPlaneWireVersion = 1;
/// A longer message is neither written nor decoded.
inline constexpr std::size_t kMaxPlaneMessageBytes = 64 * 1024;

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

  /// The messages of one update that is sent at `now`, one or more, each complete in itself: they may be lost or
  /// reordered. Valid until the next call. Without a change it is one message without tiles, until a key interval has
  /// passed by `now`; the plane's mid_exposure does not count. Negative radiance is sent as 0. invalid_argument as
  /// captured_plane_problem(); failed_precondition if the sizes differ from those of the previous call with the same
  /// capture number. Then nothing changes.
  [[nodiscard]] Result<std::span<const std::vector<std::byte>>> encode(const CapturedPlane& plane, ProbeTime now);

  /// All that was sent so far, as messages of the newest update: for a reader that joins now, which then holds what the
  /// readers of all messages hold. None before the first encode(). Valid until the next call.
  [[nodiscard]] std::span<const std::vector<std::byte>> whole();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lightwell
