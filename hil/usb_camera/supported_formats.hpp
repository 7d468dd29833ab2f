// The formats, sizes and frame rates that the camera supports, from which descriptors and negotiation are derived.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace lightwell::usb_camera {

enum class Encoding : std::uint8_t { yuyv, nv12, mjpeg };

[[nodiscard]] constexpr std::string_view to_string(Encoding encoding) {
  return std::array{"yuyv", "nv12", "mjpeg"}[static_cast<std::size_t>(encoding)];
}

struct FrameSize {
  int width = 0, height = 0;
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

struct SupportedFormats {
  std::vector<Encoding> encodings = {Encoding::yuyv, Encoding::nv12, Encoding::mjpeg};
  /// The same for each encoding; the first one is the default.
  std::vector<FrameSize> sizes;
  /// In frames per second, in descending order.
  std::vector<int> rates = {60, 30, 15};
  int default_rate = 30;
};

/// 4:3 and 16:9 for rigs with one image per lens; 2:1 for the rig "equirect".
[[nodiscard]] inline SupportedFormats formats_for(std::string_view rig) {
  SupportedFormats formats;
  if (rig == "equirect") {
    formats.sizes = {{640, 320}, {320, 160}, {1280, 640}, {1920, 960}};
  } else {
    formats.sizes = {{640, 480}, {160, 120}, {320, 240}, {1280, 720}, {1280, 960}, {1920, 1080}};
  }
  return formats;
}

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
[[nodiscard]] constexpr std::size_t largest_frame(Encoding encoding, FrameSize size) {
  const auto pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  return encoding == Encoding::nv12 ? pixels + pixels / 2 : 2 * pixels;
}

}  // namespace lightwell::usb_camera
