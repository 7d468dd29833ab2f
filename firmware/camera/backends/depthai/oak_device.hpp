// An OAK camera as the backend sees it. The real one is a DepthaiDevice; what becomes of frames is decided on this
// face.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <lightwell/result.hpp>

#include "camera/backends/depthai/oak_options.hpp"
#include "camera/backends/depthai/oak_picture.hpp"

namespace lightwell::oak {

/// From one thread at a time. None of it throws.
class OakDevice {
 public:
  virtual ~OakDevice() = default;

  /// Boots the device and lets its camera run, which takes seconds. not_found names the devices that there are. Returns
  /// what people call it.
  [[nodiscard]] virtual Result<std::string> connect(const OakOptions& options) = 0;
  virtual void disconnect() = 0;

  /// Exposure and gain from now on; they come some frames later. False where the device is gone.
  [[nodiscard]] virtual bool set_exposure(std::uint32_t exposure_us, std::uint32_t iso) = 0;

  enum class WaitResult : std::uint8_t { picture, nothing, gone };
  /// The next frame. Where nobody asks, the newest few are kept.
  [[nodiscard]] virtual WaitResult wait(OakPicture& picture, std::chrono::milliseconds timeout) = 0;
};

}  // namespace lightwell::oak
