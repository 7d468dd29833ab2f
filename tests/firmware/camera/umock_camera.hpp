// Puts the test's V4L2 device behind a node in /dev, with umockdev, for unmodified code that uses open(), mmap(),
// poll() and ioctl().
//
// The program runs with LD_PRELOAD=libumockdev-preload.so.0 (CMakeLists.txt), which redirects open() and ioctl(). The
// node is a regular file, as mmap() requires; but for poll() a regular file is always ready, so this program replaces
// poll() by a function that queries the device and blocks like the kernel's.
#pragma once

#include <memory>
#include <string>

#include "firmware/camera/v4l2_device.hpp"

namespace lightwell::test {

/// Only one may exist at a time. It is plugged in initially.
class UmockCamera {
 public:
  explicit UmockCamera(DeviceKind kind);
  ~UmockCamera();
  UmockCamera(const UmockCamera&) = delete;
  UmockCamera& operator=(const UmockCamera&) = delete;

  /// "/dev/video90": a number that does not occur on real machines, so that no real camera is used.
  [[nodiscard]] static std::string path();
  [[nodiscard]] static std::string path_renumbered();
  /// The symbolic link to it by id.
  [[nodiscard]] static std::string path_by_id();

  void unplug();
  void plug_in();
  /// Plugs it into the same port; its node is path_renumbered(), as if another camera had the old number.
  void plug_in_renumbered();
  /// Plugs another camera into the same node.
  void plug_in(DeviceKind kind);
  [[nodiscard]] V4l2Device& device();
  /// Number of mappings of the node's memory and of descriptors in this process, for leak checks.
  [[nodiscard]] static int mappings();
  [[nodiscard]] static int descriptors();

 private:
  void plug_in_as(const std::string& path);

  bool plugged_ = false;
  std::string path_;  ///< Of the current node, or of the last one.
};

}  // namespace lightwell::test
