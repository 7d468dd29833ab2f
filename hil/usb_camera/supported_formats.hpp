// The formats, sizes and frame rates that the camera supports, from which descriptors and negotiation are derived.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace lightwell::usb_camera {

enum class Encoding : std::uint8_t { yuyv, nv12, mjpeg };

[[nodiscard]] constexpr std::string_view to_string(Encoding encoding) {
  switch (encoding) {
    case Encoding::yuyv:
      return "yuyv";
    case Encoding::nv12:
      return "nv12";
    case Encoding::mjpeg:
      return "mjpeg";
  }
  return "unknown";
}

struct FrameSize {
  int width = 0, height = 0;
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

/// Unit of UVC's frame intervals.
inline constexpr double kIntervalUnit_s = 1e-7;

struct SupportedFormats {
  std::vector<Encoding> encodings = {Encoding::yuyv, Encoding::nv12, Encoding::mjpeg};
  /// The same for each encoding; the first one is the default.
  std::vector<FrameSize> sizes;
  /// In frames per second, in descending order.
  std::vector<int> rates = {60, 30, 15};
  int default_rate = 30;
};

/// 4:3 and 16:9 for rigs with one image per lens; 2:1 for the rig "equirect".
[[nodiscard]] SupportedFormats formats_for(std::string_view rig);

/// One of the supported formats.
struct StreamFormat {
  Encoding encoding = Encoding::yuyv;
  FrameSize size;
  int rate = 30;
  friend bool operator==(const StreamFormat&, const StreamFormat&) = default;
};

/// Frame interval in units of 100 ns, rounded down as in UVC.
[[nodiscard]] constexpr std::uint32_t interval_of(int rate) { return 10'000'000U / static_cast<std::uint32_t>(rate); }

/// Size of a frame in bytes; for motion JPEG the maximum.
[[nodiscard]] std::size_t largest_frame(Encoding encoding, FrameSize size);

}  // namespace lightwell::usb_camera
