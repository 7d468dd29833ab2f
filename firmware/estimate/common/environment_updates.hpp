// When a map is sent, and whether whole or as what changed.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/environment.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

struct EnvironmentUpdateOptions {
  /// Maps a second, at most, in the mean. More cost the network, and filtering time.
  double rate_hz = 5;
  /// A whole map comes at least so often (with the first map due from then on). Shorter costs bytes; longer keeps a new
  /// reader waiting.
  double key_interval_s = 1;
  /// A texel is sent again where a channel differs from the whole map by more than this share of the texel's largest
  /// channel, or of kMinRelativeTexel times the level's mean where the texel is darker than that. Larger saves bytes.
  double step = 0.01;
};

/// Encodes maps, keeps the whole one that changes refer to, and counts time. Allocates nothing after construction as
/// long as the maps that it gave out come back (update()). One thread at a time.
class EnvironmentUpdates {
 public:
  EnvironmentUpdates(std::vector<EnvironmentLevel> levels, EnvironmentUpdateOptions options);

  /// A map is due at `time`, the middle of the exposure. The first always is, and so is one whose time lies before the
  /// last one's: the clock began anew.
  [[nodiscard]] bool due(ProbeTime time) const;
  /// The next map is due at once and whole: what the numbers mean has changed.
  void restart() { key_.key = 0; }

  /// Where due(): the map of `texels` (radiance by factor, level after level), whole or as changes, whichever is right.
  /// Else none. What `out` held before is taken back, so hand in what the last call gave. Radiance that the wire cannot
  /// hold is the nearest that it can.
  void update(std::span<const Rgbx> texels, double factor, ProbeTime time, std::optional<EnvironmentMap>& out);

  /// Takes back what `out` holds, and leaves none.
  void reclaim(std::optional<EnvironmentMap>& out);

  static constexpr double kMinRelativeTexel = 0.1;

 private:
  [[nodiscard]] bool key_due(ProbeTime time) const;
  [[nodiscard]] bool fits_key(float largest) const;
  void make_key(std::span<const Rgbx> texels, double factor, float largest, ProbeTime time);
  void find_changes(std::span<const Rgbx> texels, double factor);

  EnvironmentUpdateOptions options_;
  EnvironmentMap key_;      ///< The whole map that readers have; key 0 where there is none.
  EnvironmentMap changes_;  ///< Texels and runs of the map under way.
  EnvironmentMap spare_;    ///< Memory to give out.
  ProbeTime last_, next_, key_time_;
  bool began_ = false;
};

}  // namespace lightwell::estimate
