// Latency of controls: a sensor applies new settings one or two frames after they are set.
#pragma once

#include <cstdint>
#include <deque>

#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {

class ControlLatency {
 public:
  /// Settings made while frame n is exposed act from frame n + latency; 0: from frame n.
  explicit ControlLatency(int latency) : latency_(static_cast<std::uint64_t>(latency)) {}

  /// Begins a stream; frame 0 has these settings.
  void start(const SensorSettings& settings);
  /// Sets new settings while frame `exposing` is exposed. Of several during one frame the last one counts.
  void set(const SensorSettings& settings, std::uint64_t exposing);
  /// The settings of a frame, which must not precede a discarded one.
  [[nodiscard]] const SensorSettings& at(std::uint64_t frame) const;
  /// Discards settings that only frames before `frame` need.
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
