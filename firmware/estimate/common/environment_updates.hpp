// Environment maps for estimators: from the sums of cells to the map in a descriptor, whole (keys) or as changes.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <lightwell/environment.hpp>
#include <lightwell/time.hpp>

#include "estimate/common/environment_filter.hpp"

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
  [[nodiscard]] bool due(ProbeTime time) const { return !started_ || key_.key == 0 || time >= next_ || time < last_; }
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

/// Produces prefiltered maps at its own rate. Allocates all memory when constructed. Not thread-safe.
class EnvironmentMapper {
 public:
  /// Parameters as for EnvironmentFilter and EnvironmentUpdates.
  EnvironmentMapper(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge,
                    EnvironmentUpdateOptions options = {})
      : filter_(direction, solid_angle, edge), updates_({filter_.levels().begin(), filter_.levels().end()}, options) {}

  /// Whether update() reads the sums in this frame. With a factor other than that of the last map, it always does.
  [[nodiscard]] bool due(ProbeTime mid_exposure) const { return updates_.due(mid_exposure); }

  /// Sets `out` to a map where one is due, otherwise to nullopt. `sums`: integral of radiance over each cell without
  /// the lights, in the constructor's order of cells; ignored where no map is due. `factor`: descriptor radiance per
  /// unit of radiance in `sums`; where it has changed, a whole map is sent, because readers use the last map with newer
  /// descriptors. Allocates nothing where `out` is that of the previous call.
  void update(std::span<const CellSum> sums, double factor, ProbeTime mid_exposure,
              std::optional<EnvironmentMap>& out) {
    if (factor != factor_) updates_.restart();
    factor_ = factor;
    if (!updates_.due(mid_exposure)) return updates_.reclaim(out);
    updates_.update(filter_.run(sums), factor, mid_exposure, out);
  }

 private:
  EnvironmentFilter filter_;
  EnvironmentUpdates updates_;
  double factor_ = 0;
};

}  // namespace lightwell::estimate
