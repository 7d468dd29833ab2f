// The only file that uses depthai-core (version 3).
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
  struct Running;  ///< Holds depthai's types, so that its headers are only included in the source file.
  std::unique_ptr<Running> running_;
};

}  // namespace lightwell::oak
