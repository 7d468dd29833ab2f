// Opens a device and prepares it for streaming.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/v4l2/controls.hpp"
#include "camera/backends/v4l2/device.hpp"
#include "camera/backends/v4l2/formats.hpp"
#include "camera/backends/v4l2/options.hpp"

namespace lightwell::v4l2 {

struct Connection {
  Device device;
  const Encoding* encoding = nullptr;
  Layout layout;
  double rate = 0;
  ExposureControl exposure;
  MappedBuffers buffers;
  /// Frames lend the driver's memory; false: they are converted, or copied because the driver gave too few buffers.
  bool zero_copy = false;
};

/// Buffers that stay queued while all frames are lent, so that the driver continues to capture and count frames.
inline constexpr int kMinQueuedBuffers = 3;

/// Opens the device, negotiates the format, sets controls, maps buffers. Appends texts for CameraInfo::notes to
/// `notes`.
[[nodiscard]] Result<Connection> connect(const Options& options, std::vector<std::string>& notes);

}  // namespace lightwell::v4l2
