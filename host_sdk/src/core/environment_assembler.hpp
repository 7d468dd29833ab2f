// Assembles the current environment map from descriptors with a whole map, with changes, or without a map.
#pragma once

#include <cstdint>
#include <memory>

#include <lightwell/descriptor.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// A whole map and the descriptor to which it belongs.
struct EnvironmentSnapshot {
  EnvironmentMap map;
  std::uint64_t sequence = 0;
  ProbeTime mid_exposure;
  Units units = Units::relative;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
};

/// The current map of one probe. One thread.
class EnvironmentAssembler {
 public:
  /// Processes a received descriptor. False if it has changes to a whole map that was not received; then the current
  /// map is kept. True also for a descriptor without a map.
  bool take(const Descriptor& descriptor);

  /// The newest map if it applies to `descriptor`: same probe, calibration and units, not newer, and not older than
  /// kMaxIntervals of its key intervals. Null otherwise.
  [[nodiscard]] std::shared_ptr<const EnvironmentSnapshot> map_for(const Descriptor& descriptor) const;

 private:
  static constexpr std::int64_t kMaxIntervals = 3;

  std::shared_ptr<const EnvironmentSnapshot> key_;     ///< The last whole map, without changes.
  std::shared_ptr<const EnvironmentSnapshot> newest_;  ///< The last whole map with the last changes, if any.
};

}  // namespace lightwell::core
