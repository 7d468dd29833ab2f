// The one place that talks to depthai-core, of version 3.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "camera/backends/depthai/oak_device.hpp"

namespace lightwell::oak {

class DepthaiDevice final : public OakDevice {
 public:
  DepthaiDevice();
  ~DepthaiDevice() override;

  [[nodiscard]] Result<std::string> connect(const OakOptions& options) override;
  void disconnect() override;
  [[nodiscard]] bool set_exposure(std::uint32_t exposure_us, std::uint32_t iso) override;
  [[nodiscard]] WaitResult wait(OakPicture& picture, std::chrono::milliseconds timeout) override;

 private:
  struct Running;  ///< depthai's own; its headers stay in the source.
  std::unique_ptr<Running> running_;
};

}  // namespace lightwell::oak
