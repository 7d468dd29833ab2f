// What a PlaneReader holds of a captured plane.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// A tile is the newest one if held == listed. If held is 0 and listed is not, none has arrived: its entries are
/// unseen and zero, as those of a tile that the probe never sent.
struct PlaneState {
  CapturedPlane plane;  ///< As far as received.
  std::uint64_t revision = 0;
  Duration key_interval;
  HostTime received;  ///< Of the newest message.
  PlaneTileLayout layout;
  std::vector<std::uint64_t> listed;  ///< By tile: revision of the newest content of which a message told.
  std::vector<std::uint64_t> held;    ///< By tile: revision of what `plane` has.
  std::size_t missing = 0;            ///< Number of tiles with held != listed.

  /// Whether the entry is of the newest content, of an older one, or has not arrived.
  [[nodiscard]] Validity freshness(PlanePart part, std::size_t entry) const {
    return missing == 0 ? Validity::valid : freshness_of_tile(layout.tile_of(part, entry));
  }

 private:
  [[nodiscard]] Validity freshness_of_tile(std::size_t tile) const {
    if (held[tile] == listed[tile]) return Validity::valid;
    return held[tile] == 0 ? Validity::none : Validity::stale;
  }
};

}  // namespace lightwell::core
