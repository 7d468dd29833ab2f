#include "core/environment_assembler.hpp"

#include <utility>

namespace lightwell::core {

bool EnvironmentAssembler::take(const Descriptor& descriptor) {
  if (!descriptor.environment) return true;
  const EnvironmentMap& came = *descriptor.environment;
  auto kept = std::make_shared<EnvironmentSnapshot>();
  kept->sequence = descriptor.sequence;
  kept->mid_exposure = descriptor.time.mid_exposure;
  kept->units = descriptor.units;
  kept->probe_id = descriptor.probe_id;
  kept->calibration_id = descriptor.calibration_id;
  if (came.whole()) {
    kept->map = came;
    key_ = std::move(kept);
    newest_ = key_;
    return true;
  }
  if (!key_ || !apply_changes(key_->map, came, kept->map)) return false;
  newest_ = std::move(kept);
  return true;
}

std::shared_ptr<const EnvironmentSnapshot> EnvironmentAssembler::map_for(const Descriptor& descriptor) const {
  if (!newest_ || newest_->units != descriptor.units || newest_->probe_id != descriptor.probe_id ||
      newest_->calibration_id != descriptor.calibration_id)
    return nullptr;
  const Duration older = descriptor.time.mid_exposure - newest_->mid_exposure;
  const std::int64_t longest_ns = kMaxIntervals * std::int64_t{newest_->map.key_interval_ms} * 1'000'000;
  if (older < Duration{} || older > Duration{longest_ns}) return nullptr;
  return newest_;
}

}  // namespace lightwell::core
