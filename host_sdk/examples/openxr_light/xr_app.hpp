// The OpenXR part of the sample: instance, headless session, spaces and time. Independent of lighting.
//   XrApp   the available parts, and a message for each missing one
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>

// Selects the parts of the platform header, and the system's time type.
#include <time.h>
#define XR_USE_TIMESPEC 1
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace openxr_light {

/// OpenXR has the same axes, quaternion order and handedness as Lightwell.
[[nodiscard]] inline lightwell::Pose pose_of(const XrPosef& pose) {
  return {{pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w},
          {pose.position.x, pose.position.y, pose.position.z}};
}

/// One thread. Everything is destroyed in the order that OpenXR requires.
class XrApp {
 public:
  /// Initialises as far as loader and runtime allow. Never fails: missing() lists what is not available.
  XrApp();
  ~XrApp();
  XrApp(const XrApp&) = delete;
  XrApp& operator=(const XrApp&) = delete;

  /// One message for each missing part, with the remedy; empty if all are available.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

  /// Name and version of the runtime; empty without an instance.
  [[nodiscard]] const std::string& runtime() const { return runtime_; }

  /// The reference space of the world: "STAGE", or "LOCAL" if the runtime has no stage; empty without a session.
  [[nodiscard]] const std::string& world_space() const { return world_name_; }

  /// Handles the runtime's events; false once it has asked the application to end.
  [[nodiscard]] bool poll_events();

  /// T_world_view, the head pose in world space. No value without a session, and while the head is not tracked.
  [[nodiscard]] std::optional<lightwell::Pose> view_in_world() const;

  /// Converts a time of CLOCK_MONOTONIC (lightwell::HostTime) to the runtime's time. No value if the runtime lacks
  /// XR_KHR_convert_timespec_time.
  [[nodiscard]] std::optional<XrTime> xr_time(std::int64_t monotonic_ns) const;

 private:
  [[nodiscard]] bool create_instance();
  [[nodiscard]] bool create_session();
  [[nodiscard]] bool create_spaces();
  [[nodiscard]] XrSpace make_space(XrReferenceSpaceType type) const;
  void lacks(std::string what);
  /// "xrCreateSession: XR_ERROR_...".
  [[nodiscard]] std::string failed(const char* call, XrResult result) const;

  std::vector<std::string> missing_;
  std::string runtime_, world_name_;
  bool headless_ = false, timespec_ = false, ended_ = false;
  XrInstance instance_ = XR_NULL_HANDLE;
  XrSession session_ = XR_NULL_HANDLE;
  XrSpace world_ = XR_NULL_HANDLE, view_ = XR_NULL_HANDLE;
  PFN_xrConvertTimespecTimeToTimeKHR to_xr_time_ = nullptr;
};

}  // namespace openxr_light
