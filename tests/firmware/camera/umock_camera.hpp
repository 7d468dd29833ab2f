// The test's V4L2 device behind a node in /dev, by umockdev: for unmodified code that opens, maps, polls and asks.
//
// The program runs with LD_PRELOAD=libumockdev-preload.so.0 (CMakeLists.txt), which leads open() and ioctl() here. The
// node is a regular file, which is what mmap() needs; but poll() finds a regular file always ready, so this program
// has a poll() of its own, which asks the device and blocks like the kernel's.
#pragma once

#include <memory>
#include <string>

#include "firmware/camera/v4l2_device.hpp"

namespace lightwell::test {

/// One at a time in a program. Made plugged in.
class UmockCamera {
 public:
  explicit UmockCamera(DeviceKind kind);
  ~UmockCamera();
  UmockCamera(const UmockCamera&) = delete;
  UmockCamera& operator=(const UmockCamera&) = delete;

  /// "/dev/video90": no machine has so many, so that none of its own is met by mistake.
  [[nodiscard]] static std::string path();
  /// The same by its lasting name.
  [[nodiscard]] static std::string path_by_id();

  void unplug();
  void plug_in();
  /// Another camera in the same place.
  void plug_in(DeviceKind kind);
  [[nodiscard]] V4l2Device& device();
  /// Mappings of the node's memory and descriptors that this process has, for comparison.
  [[nodiscard]] static int mappings();
  [[nodiscard]] static int descriptors();

 private:
  bool plugged_ = false;
};

}  // namespace lightwell::test
