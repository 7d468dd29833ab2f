// The environment map through the messages that bring it: whole ones, changes, and none.
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/descriptor.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// A whole map and the light that it belongs to.
struct EnvironmentSnapshot {
  EnvironmentMap map;
  std::uint64_t sequence = 0;
  ProbeTime mid_exposure;
  Units units = Units::relative;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
};

/// What one reader of a probe knows of its map. One thread.
class EnvironmentAssembler {
 public:
  /// A descriptor as it came. False where it brought changes to a whole map that is not here: then
  /// everything stays as it was. True also where it brought nothing.
  bool take(const Descriptor& descriptor);

  /// The newest map, where it speaks of the same light as `descriptor`: same probe, calibration and
  /// units, not newer, and not older than kMaxIntervals of its own. Null otherwise.
  [[nodiscard]] std::shared_ptr<const EnvironmentSnapshot> map_for(const Descriptor& descriptor) const;

 private:
  static constexpr std::int64_t kMaxIntervals = 3;

  std::shared_ptr<const EnvironmentSnapshot> key_;     ///< The last whole one, as it came.
  std::shared_ptr<const EnvironmentSnapshot> newest_;  ///< That, or it with the last changes.
};

}  // namespace lightwell::core
