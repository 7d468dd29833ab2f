// What the camera offers: formats, sizes, rates. Descriptors and negotiation are both made from this list.
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

/// UVC's frame intervals count in these.
inline constexpr double kIntervalUnit_s = 1e-7;

struct SupportedFormats {
  std::vector<Encoding> encodings = {Encoding::yuyv, Encoding::nv12, Encoding::mjpeg};
  /// The same for each encoding, the first one being the default.
  std::vector<FrameSize> sizes;
  /// Frames a second, whole numbers from fast to slow.
  std::vector<int> rates = {60, 30, 15};
  int default_rate = 30;
};

/// 4:3 and 16:9 for rigs of a picture a lens; 2:1 for the equirectangular one.
[[nodiscard]] SupportedFormats offer_for(std::string_view rig);

/// One choice from an offer.
struct StreamFormat {
  Encoding encoding = Encoding::yuyv;
  FrameSize size;
  int rate = 30;
  friend bool operator==(const StreamFormat&, const StreamFormat&) = default;
};

/// In units of 100 ns, as UVC rounds it: downwards.
[[nodiscard]] constexpr std::uint32_t interval_of(int rate) { return 10'000'000U / static_cast<std::uint32_t>(rate); }

/// The bytes of a frame; of a motion JPEG, the bytes that none exceeds.
[[nodiscard]] std::size_t largest_frame(Encoding encoding, FrameSize size);

}  // namespace lightwell::usb_camera
