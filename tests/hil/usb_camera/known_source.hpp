// A frame source with computable images, which are ready at once unless the test delays them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera::bench {

/// Every byte depends on the frame's number and its position; the first four hold the exposure in units of 100 us.
inline std::vector<std::byte> known_picture(std::uint64_t number, const SensorSettings& settings, std::size_t bytes) {
  std::vector<std::byte> out(bytes);
  for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<std::byte>(31 * number + 7 * i + (i >> 8));
  const auto exposure = static_cast<std::uint32_t>(settings.exposure_s * 1e4 + 0.5);
  for (std::size_t i = 0; i < 4 && i < bytes; ++i) out[i] = static_cast<std::byte>(exposure >> (8 * i));
  return out;
}

class KnownSource final : public FrameSource {
 public:
  Status configure(const StreamFormat& format) override {
    ++configured;
    format_ = format;
    return refuse;
  }
  [[nodiscard]] double automatic_exposure_s() const override { return automatic_s; }
  [[nodiscard]] double readout_s() const override { return readout; }
  Picture picture(std::uint64_t number, const SensorSettings& settings) override {
    if (not_ready.contains(number)) return nullptr;
    return std::make_shared<const std::vector<std::byte>>(known_picture(number, settings, bytes()));
  }
  void order(std::uint64_t number, const SensorSettings& settings) override { ordered[number] = settings; }

  [[nodiscard]] std::size_t bytes() const {
    return short_by + 1 > largest_frame(format_.encoding, format_.size)
               ? 1
               : largest_frame(format_.encoding, format_.size) - short_by;
  }

  Status refuse;
  double automatic_s = 0.0023, readout = 0;
  std::size_t short_by = 0;  ///< Frames are this much shorter than the maximum, as with motion JPEG.
  std::set<std::uint64_t> not_ready;
  std::map<std::uint64_t, SensorSettings> ordered;
  int configured = 0;

 private:
  StreamFormat format_;
};

}  // namespace lightwell::usb_camera::bench
