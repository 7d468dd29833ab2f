#include "camera/backends/depthai/depthai_backend.hpp"

#include <algorithm>
#include <exception>
#include <span>
#include <utility>

#include <depthai/device/Device.hpp>
#include <depthai/pipeline/InputQueue.hpp>
#include <depthai/pipeline/MessageQueue.hpp>
#include <depthai/pipeline/Pipeline.hpp>
#include <depthai/pipeline/datatype/CameraControl.hpp>
#include <depthai/pipeline/datatype/ImgFrame.hpp>
#include <depthai/pipeline/node/Camera.hpp>

#include "camera/backends/depthai/oak_device.hpp"

namespace lightwell {
namespace {

using namespace oak;

/// Length of the output queue; a longer one would only add latency.
constexpr unsigned kQueue = 4;

dai::CameraBoardSocket socket_of(char letter) {
  return static_cast<dai::CameraBoardSocket>(static_cast<int>(dai::CameraBoardSocket::CAM_A) + (letter - 'A'));
}

std::string all_devices() {
  std::string list;
  for (const dai::DeviceInfo& info : dai::Device::getAllConnectedDevices())
    list += (list.empty() ? "" : ", ") + info.getDeviceId() + " (" + info.name + ")";
  return list.empty() ? "none: is one connected, and do depthai's udev rules allow this user to open it?" : list;
}

struct Running {
  std::shared_ptr<dai::Device> device;
  std::unique_ptr<dai::Pipeline> pipeline;
  std::shared_ptr<dai::MessageQueue> frames;
  std::shared_ptr<dai::InputQueue> controls;

  ~Running() {
    // Close what exists; errors of a device that is gone are ignored.
    try {
      if (pipeline) pipeline->stop();
      if (device) device->close();
    } catch (const std::exception&) {
    }
  }
};

/// The only class that uses depthai-core.
class DepthaiDevice final : public OakDevice {
 public:
  [[nodiscard]] Result<std::string> connect(const OakOptions& options) override {
    running_.reset();
    auto made = std::make_unique<Running>();
    try {
      // A device that is given by address or name need not answer the search, so do not require it in the list.
      const auto [found, info] = dai::Device::getDeviceById(options.id);
      try {
        made->device = std::make_shared<dai::Device>(found ? info : dai::DeviceInfo(options.id));
      } catch (const std::exception& e) {
        return Status(found ? StatusCode::unavailable : StatusCode::not_found,
                      "no device '" + options.id + "': " + e.what() + "; there are: " + all_devices());
      }
      std::string sockets;
      bool has_socket = false;
      for (const dai::CameraBoardSocket socket : made->device->getConnectedCameras()) {
        sockets += (sockets.empty() ? "" : ", ") + dai::toString(socket);
        has_socket = has_socket || socket == socket_of(options.socket);
      }
      if (!has_socket)
        return Status(StatusCode::not_found, "device '" + options.id + "' has no camera at socket " + options.socket +
                                                 "; it has cameras at: " + sockets);
      const bool raw = options.format == PixelFormat::bayer_rggb10;
      const std::pair<std::uint32_t, std::uint32_t> size(static_cast<std::uint32_t>(options.width),
                                                         static_cast<std::uint32_t>(options.height));
      const auto rate = static_cast<float>(options.frame_rate);
      made->pipeline = std::make_unique<dai::Pipeline>(made->device);
      const auto camera = made->pipeline->create<dai::node::Camera>();
      // Raw pictures are only available in sizes of the sensor.
      if (raw)
        camera->build(socket_of(options.socket), size, rate);
      else
        camera->build(socket_of(options.socket));
      camera->initialControl.setManualExposure(options.exposure_us.front(), options.iso);
      camera->initialControl.setManualWhiteBalance(options.white_balance_k);
      camera->initialControl.setAutoFocusMode(dai::CameraControl::AutoFocusMode::OFF);
      dai::Node::Output* const output =
          raw ? &camera->raw : camera->requestOutput(size, dai::ImgFrame::Type::NV12, dai::ImgResizeMode::CROP, rate);
      made->frames = output->createOutputQueue(kQueue, false);
      made->controls = camera->inputControl.createInputQueue();
      made->pipeline->start();
      running_ = std::move(made);
      return running_->device->getDeviceName() + " " + running_->device->getDeviceId();
    } catch (const std::exception& e) {
      return Status(StatusCode::unavailable, "device '" + options.id + "': " + e.what());
    }
  }

  void disconnect() override { running_.reset(); }
  [[nodiscard]] bool set_exposure(std::uint32_t exposure_us, std::uint32_t iso) override {
    if (!running_) return false;
    try {
      auto control = std::make_shared<dai::CameraControl>();
      control->setManualExposure(exposure_us, iso);
      running_->controls->send(control);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

  [[nodiscard]] WaitResult wait(OakPicture& picture, std::chrono::milliseconds timeout) override {
    if (!running_) return WaitResult::gone;
    try {
      bool timed_out = false;
      const auto frame = running_->frames->get<dai::ImgFrame>(timeout, timed_out);
      if (!frame)
        return running_->device->isClosed() || running_->frames->isClosed() ? WaitResult::gone : WaitResult::nothing;
      const auto data = std::as_const(*frame).getData();
      picture.holder = frame;
      picture.data = std::as_bytes(std::span<const std::uint8_t>(data.data(), data.size()));
      picture.width = static_cast<int>(frame->getWidth());
      picture.height = static_cast<int>(frame->getHeight());
      picture.stride = frame->getStride();
      picture.plane_stride = frame->getPlaneStride(0);
      picture.timestamp_ns =
          std::chrono::nanoseconds(frame->getTimestamp(dai::CameraExposureOffset::END).time_since_epoch()).count();
      picture.sequence = frame->getSequenceNum();
      picture.exposure_us = static_cast<std::uint32_t>(std::max<std::int64_t>(0, frame->getExposureTime().count()));
      picture.iso = static_cast<std::uint32_t>(std::max(0, frame->getSensitivity()));
      return WaitResult::picture;
    } catch (const std::exception&) {
      return WaitResult::gone;
    }
  }

 private:
  std::unique_ptr<Running> running_;
};

}  // namespace

Result<std::unique_ptr<CameraBackend>> make_depthai_backend(const CameraUri& uri, const CameraConfig& config) {
  Result<OakOptions> options = parse_options(uri, config);
  if (!options) return options.status();
  return make_oak_backend(std::move(*options), std::make_unique<DepthaiDevice>());
}

}  // namespace lightwell
