// One opening of a device: from its path to buffers that could stream.
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
  /// Frames lend the driver's memory; otherwise they are converted, or copied where the driver gave too few buffers.
  bool zero_copy = false;
};

/// Buffers that stay with the driver while all frames are lent, so that it goes on counting.
inline constexpr int kMinQueuedBuffers = 3;

/// Opens, negotiates, sets controls, maps buffers. `notes` gets what CameraInfo::notes should say.
[[nodiscard]] Result<Connection> connect(const Options& options, std::vector<std::string>& notes);

}  // namespace lightwell::v4l2
