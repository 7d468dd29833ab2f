// What can be asked of a running camera through its control socket: one JSON object a line, one answered by another.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

#include "usb_camera/device.hpp"
#include "usb_camera/json.hpp"

namespace lightwell::usb_camera {

/// Whoever owns the cable between device and host.
class Cable {
 public:
  /// `close`: the connection to QEMU ends; otherwise the device is only reported gone.
  virtual void unplug(bool close) = 0;
  /// As at power-on. Where no host is there, it is plugged into the next one that comes.
  virtual void plug() = 0;
  [[nodiscard]] virtual bool plugged() const = 0;
  [[nodiscard]] virtual bool host_there() const = 0;

 protected:
  ~Cable() = default;
};

/// What commands act on. The functions may be empty: then there is no such thing to act on.
struct CommandTargets {
  Device* device = nullptr;
  FrameLog* log = nullptr;
  Cable* cable = nullptr;
  TransferSink* sink = nullptr;
  std::function<Status(const std::string& uri)> set_scene;
  std::function<std::string()> rendering;  ///< A JSON object with what the renderer counts.
};

/// Carries one out. The answer is {"ok": true, ...} or {"ok": false, "error": "..."}, without a line's end. Commands
/// and their values: hil/README.md, and `help`.
[[nodiscard]] std::string execute_command(std::string_view line, const CommandTargets& targets, CameraTime now);

}  // namespace lightwell::usb_camera
