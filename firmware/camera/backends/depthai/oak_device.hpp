// Interface of an OAK camera. DepthaiDevice implements it with depthai-core; OakBackend uses only this interface.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <lightwell/result.hpp>

#include "camera/backends/depthai/oak_options.hpp"
#include "camera/backends/depthai/oak_picture.hpp"

namespace lightwell::oak {

/// One thread at a time. No method throws.
class OakDevice {
 public:
  virtual ~OakDevice() = default;

  /// Boots the device and starts its camera, which takes seconds. Returns its display name. not_found lists the
  /// devices.
  [[nodiscard]] virtual Result<std::string> connect(const OakOptions& options) = 0;
  virtual void disconnect() = 0;

  /// Requests exposure and gain; they take effect some frames later. False if the device is gone.
  [[nodiscard]] virtual bool set_exposure(std::uint32_t exposure_us, std::uint32_t iso) = 0;

  enum class WaitResult : std::uint8_t { picture, nothing, gone };
  /// Waits for the next frame. Between calls only the newest few frames are kept.
  [[nodiscard]] virtual WaitResult wait(OakPicture& picture, std::chrono::milliseconds timeout) = 0;
};

}  // namespace lightwell::oak
