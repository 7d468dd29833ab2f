#include "usb_camera/control_latency.hpp"

namespace lightwell::usb_camera {

void ControlLatency::start(const SensorSettings& settings) { changes_ = {{0, settings}}; }

void ControlLatency::set(const SensorSettings& settings, std::uint64_t exposing) {
  const std::uint64_t from = exposing + latency_;
  if (changes_.back().from == from) {
    changes_.back().settings = settings;
  } else {
    changes_.push_back({from, settings});
  }
}

const SensorSettings& ControlLatency::at(std::uint64_t frame) const {
  for (auto change = changes_.rbegin(); change != changes_.rend(); ++change)
    if (change->from <= frame) return change->settings;
  return changes_.front().settings;
}

void ControlLatency::discard_before(std::uint64_t frame) {
  while (changes_.size() > 1 && changes_[1].from <= frame) changes_.pop_front();
}

}  // namespace lightwell::usb_camera
