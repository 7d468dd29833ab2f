// The camera's pose from one AprilTag in its picture.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <lightwell/geometry.hpp>

#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

class TagTracker {
 public:
  TagTracker(const TrackedTag& tag, const CameraModel& camera);
  TagTracker(TagTracker&&) noexcept;
  TagTracker& operator=(TagTracker&&) noexcept;
  ~TagTracker();

  /// T_world_camera in a picture of the camera without distortion, row by row; nullopt if the tag is not found, or is
  /// found twice. Corners by libapriltag; pose by IPPE (Collins & Bartoli 2014), of whose two solutions for a flat
  /// target the one with the smaller error is refined by least squares of the corners' pixels.
  [[nodiscard]] std::optional<Pose> find(std::span<const std::uint8_t> grey);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell::viewer
