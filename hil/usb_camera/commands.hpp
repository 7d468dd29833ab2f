// Commands of the control socket: each request is one JSON object on a line, and so is each response.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

#include "usb_camera/device.hpp"
#include "usb_camera/scene_source.hpp"

namespace lightwell::usb_camera {

/// The simulated USB cable between device and host.
class Cable {
 public:
  /// `close`: closes the connection to QEMU; otherwise only reports that the device is gone.
  virtual void unplug(bool close) = 0;
  /// Plugs the device in, in its power-on state. Without a host, it is plugged into the next one that connects.
  virtual void plug() = 0;
  [[nodiscard]] virtual bool plugged() const = 0;
  [[nodiscard]] virtual bool host_there() const = 0;

 protected:
  ~Cable() = default;
};

/// The objects that commands act on. Functions may be empty; a command that needs one then returns an error.
struct CommandTargets {
  Device* device = nullptr;
  FrameLog* log = nullptr;
  Cable* cable = nullptr;
  TransferSink* sink = nullptr;
  std::function<Status(const std::string& uri)> set_scene;
  std::function<RenderCounts()> render_counts;
};

/// Executes one command. The response is {"ok": true, ...} or {"ok": false, "error": "..."}, without a newline.
/// Commands and their values: hil/README.md, and the command `help`.
[[nodiscard]] std::string execute_command(std::string_view line, const CommandTargets& targets, CameraTime now);

}  // namespace lightwell::usb_camera
