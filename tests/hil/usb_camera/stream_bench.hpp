// A stream with a known frame source, a test host and a simulated clock.
#pragma once

#include <gtest/gtest.h>

#include "hil/usb_camera/known_source.hpp"
#include "hil/usb_camera/video_host.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera::bench {

inline constexpr std::int64_t kMs = 1'000'000;

class StreamBench {
 public:
  explicit StreamBench(Pace pace, int latency = 2, bool stamp = false)
      : stream({.pace = pace, .control_latency = latency, .stamp = stamp, .ahead = 4}, source, log) {}

  void arm(Encoding encoding = Encoding::yuyv, int rate = 100) {
    NegotiatedFormat agreed;
    agreed.format = {encoding, {160, 120}, rate};
    agreed.frame_bytes = static_cast<std::uint32_t>(largest_frame(encoding, {160, 120}));
    agreed.payload_bytes = agreed.frame_bytes + 12;
    EXPECT_TRUE(stream.arm(agreed, settings).ok());
  }

  /// Advances the time by `ms` in steps of a millisecond; the host keeps `transfers` transfers queued.
  void run(std::int64_t ms, std::size_t transfers = 5) {
    for (std::int64_t end = now.ns + ms * kMs; now.ns < end; now = now + Duration{kMs}) {
      // The host queues new transfers several times within a millisecond.
      for (int again = 0; again < 10; ++again) {
        if (transfers > 0) host.queue(stream, transfers);
        stream.run(now, host);
      }
    }
  }

  void set_exposure(double exposure_s) {
    settings.exposure_s = exposure_s;
    stream.set(settings);
  }

  /// The bytes of a frame without faults.
  [[nodiscard]] std::vector<std::uint8_t> expected(const FrameRecord& record) const {
    const std::vector<std::byte> picture = known_picture(record.number, record.settings, source.bytes());
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(picture.data());
    return {begin, begin + picture.size()};
  }

  [[nodiscard]] std::vector<FrameRecord> with(Outcome outcome) const {
    std::vector<FrameRecord> out;
    for (const FrameRecord& record : log.records())
      if (record.outcome == outcome) out.push_back(record);
    return out;
  }

  KnownSource source;
  FrameLog log;
  Stream stream;
  VideoHost host{160 * 120 * 2 + 12, 16384};
  SensorSettings settings{.exposure_s = 0.002, .gain = 1, .kelvin = 6500};
  CameraTime now{1'000'000'000'000};
};

}  // namespace lightwell::usb_camera::bench
