// Which frame a control acts from: a sensor takes new settings up a frame or two after it was told.
#pragma once

#include <cstdint>
#include <deque>

#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {

class ControlLatency {
 public:
  /// Set while frame n is being exposed, settings act from frame n + latency. 0: from that very frame.
  explicit ControlLatency(int latency) : latency_(static_cast<std::uint64_t>(latency)) {}

  /// A stream begins: frame 0 has these.
  void start(const SensorSettings& settings);
  /// Of several during one frame the last one counts.
  void set(const SensorSettings& settings, std::uint64_t exposing);
  /// In force for a frame. Frames are asked for in order: what lies before is forgotten when `frame` is passed.
  [[nodiscard]] const SensorSettings& at(std::uint64_t frame) const;
  void discard_before(std::uint64_t frame);

 private:
  struct Change {
    std::uint64_t from = 0;
    SensorSettings settings;
  };
  std::uint64_t latency_;
  std::deque<Change> changes_{Change{}};  ///< Never empty.
};

}  // namespace lightwell::usb_camera
