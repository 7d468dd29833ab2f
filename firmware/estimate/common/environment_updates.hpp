// Schedules and encodes environment maps: whole maps (keys) and changes relative to them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/environment.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

struct EnvironmentUpdateOptions {
  /// Largest mean rate of maps. A higher rate costs bandwidth and time for filtering.
  double rate_hz = 5;
  /// Interval of whole maps; the first map that is due after it is whole. A shorter one costs bytes; with a longer one,
  /// a new reader waits longer.
  double key_interval_s = 1;
  /// A texel is sent again where a channel differs from the whole map by more than this share of the texel's largest
  /// channel, or of kMinRelativeTexel times the level's mean if that is more. Larger values save bytes.
  double step = 0.01;
};

/// Encodes maps, and keeps the last whole map and the schedule. Allocates nothing after construction if every map is
/// passed back to update(). Not thread-safe.
class EnvironmentUpdates {
 public:
  EnvironmentUpdates(std::vector<EnvironmentLevel> levels, EnvironmentUpdateOptions options);

  /// Whether a map is due at `time` (mid-exposure). The first is, and so is one whose time is before that of the last
  /// map: the clock was restarted.
  [[nodiscard]] bool due(ProbeTime time) const;
  /// Makes the next map due at once and whole. For changes of the scale.
  void restart() { key_.key = 0; }

  /// Where due(): sets `out` to the map of `texels` (descriptor radiance / factor, level by level), whole or as
  /// changes. Otherwise sets it to nullopt. Reuses the memory in `out`, which should hold the result of the previous
  /// call. Radiance outside of the encodable range is clamped.
  void update(std::span<const Rgbx> texels, double factor, ProbeTime time, std::optional<EnvironmentMap>& out);

  /// Takes over the memory of `out` and sets it to nullopt.
  void reclaim(std::optional<EnvironmentMap>& out);

  static constexpr double kMinRelativeTexel = 0.1;

 private:
  [[nodiscard]] bool key_due(ProbeTime time) const;
  [[nodiscard]] bool fits_key(float largest) const;
  void make_key(std::span<const Rgbx> texels, double factor, float largest, ProbeTime time);
  void find_changes(std::span<const Rgbx> texels, double factor);

  EnvironmentUpdateOptions options_;
  EnvironmentMap key_;      ///< The last whole map; key 0 where there is none.
  EnvironmentMap changes_;  ///< Texels and runs of the current map.
  EnvironmentMap spare_;    ///< Memory for the next result.
  ProbeTime last_, next_, key_time_;
  bool started_ = false;
};

}  // namespace lightwell::estimate
