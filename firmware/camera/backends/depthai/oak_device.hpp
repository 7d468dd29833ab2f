// An OAK camera as the backend sees it: options, frames, and OakDevice, which depthai_backend.cpp implements.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell::oak {

struct OakOptions {
  std::string id;                          ///< MXID (device id), IP address or name, as depthai takes them.
  char socket = 'A';                       ///< Board socket, A to J.
  PixelFormat format = PixelFormat::nv12;  ///< nv12, or bayer_rggb10 from the sensor itself.
  int width = 640, height = 480;
  double frame_rate = 30;
  std::vector<std::uint32_t> exposure_us;  ///< One entry or more.
  std::uint32_t iso = 100;                 ///< 100: a gain of 1.
  /// Colour temperature of the fixed white balance, K.
  int white_balance_k = static_cast<int>(CaptureSettings::kDefaultWhiteBalance_k);
  Duration row_readout;
  std::vector<std::string> notes;  ///< Deviations from the request, and former names of parameters.

  [[nodiscard]] double gain() const { return gain_of_iso(iso); }
  [[nodiscard]] static double gain_of_iso(std::uint32_t iso_value) { return iso_value / 100.0; }
};

/// Clamps exposures to the frame interval and gains to depthai's 1 to 16, with notes. invalid_argument: a parameter.
[[nodiscard]] Result<OakOptions> parse_options(const CameraUri& uri, const CameraConfig& config);

/// A frame on the host, as delivered by depthai.
struct OakPicture {
  std::shared_ptr<const void> holder;  ///< Owner of the memory of `data`.
  std::span<const std::byte> data;
  int width = 0, height = 0;
  std::size_t stride = 0;         ///< Bytes between the starts of successive rows.
  std::size_t plane_stride = 0;   ///< Bytes from the first plane to the second.
  std::int64_t timestamp_ns = 0;  ///< End of the first row's exposure, synchronised to the host: CLOCK_MONOTONIC.
  std::int64_t sequence = 0;
  std::uint32_t exposure_us = 0;  ///< Exposure of this frame; 0: not reported.
  std::uint32_t iso = 0;
};

/// Middle of the centre row's exposure. Empty for a timestamp of another clock: in the future, or more than 5 s ago.
[[nodiscard]] std::optional<ProbeTime> mid_exposure(const OakPicture& picture, Duration row_readout, ProbeTime now);

/// Unpacks MIPI CSI-2 RAW10 (specification v1.3, 11.4.4: the high bytes of four pixels, then their low bits) into
/// 10-bit values, rows without padding. data_loss if the rows are shorter than `width` pixels, or `words` is too small.
[[nodiscard]] Status unpack_raw10(const OakPicture& picture, std::span<std::uint16_t> words);

/// One thread at a time. No method throws.
class OakDevice {
 public:
  virtual ~OakDevice() = default;

  /// Boots the device and starts its camera, in seconds. Returns its display name. not_found lists all devices.
  [[nodiscard]] virtual Result<std::string> connect(const OakOptions& options) = 0;
  virtual void disconnect() = 0;

  /// Requests exposure and gain; they take effect some frames later. False if the device is gone.
  [[nodiscard]] virtual bool set_exposure(std::uint32_t exposure_us, std::uint32_t iso) = 0;

  enum class WaitResult : std::uint8_t { picture, nothing, gone };
  /// Waits for the next frame. Between calls only the newest few frames are kept.
  [[nodiscard]] virtual WaitResult wait(OakPicture& picture, std::chrono::milliseconds timeout) = 0;
};

/// The backend over an OAK device. The device runs from open() until the backend is destroyed; between start() and
/// stop() its frames are pushed. The frames are in memory of this process, which is lent without a copy; raw frames are
/// unpacked into slots. After a disconnection, a reconnection is tried once a second.
[[nodiscard]] std::unique_ptr<CameraBackend> make_oak_backend(OakOptions options, std::unique_ptr<OakDevice> device);

}  // namespace lightwell::oak
