// The OpenXR half of the sample: an instance, a headless session, spaces and time. Knows nothing of light.
//   XrApp   what of it there is; what is missing has a sentence
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>

// The platform header needs to know which parts of it are wanted, and the time of which system.
#include <time.h>
#define XR_USE_TIMESPEC 1
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace openxr_light {

/// OpenXR's axes are Lightwell's, and so are the order and the handedness of its quaternions.
[[nodiscard]] inline lightwell::Pose pose_of(const XrPosef& pose) {
  return {{pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w},
          {pose.position.x, pose.position.y, pose.position.z}};
}

/// One thread. Everything is destroyed in the order that OpenXR asks for.
class XrApp {
 public:
  /// Goes as far as loader and runtime allow. Never fails: missing() says what is not there.
  XrApp();
  ~XrApp();
  XrApp(const XrApp&) = delete;
  XrApp& operator=(const XrApp&) = delete;

  /// One sentence for each thing that is not there, with what would bring it; empty where all is.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

  /// Name and version of the runtime; empty without an instance.
  [[nodiscard]] const std::string& runtime() const { return runtime_; }

  /// What the origin of the world is: "STAGE", or "LOCAL" where the runtime has no stage; empty without a session.
  [[nodiscard]] const std::string& world_space() const { return world_name_; }

  /// Handles the runtime's events; false once it has asked the application to end.
  [[nodiscard]] bool poll_events();

  /// T_world_view, where the head is in the world space. None without a session, and while it is not tracked.
  [[nodiscard]] std::optional<lightwell::Pose> view_in_world() const;

  /// A moment of CLOCK_MONOTONIC, which is what lightwell::HostTime counts, in the runtime's time. None where the
  /// runtime lacks XR_KHR_convert_timespec_time.
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
