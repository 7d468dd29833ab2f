#include <memory>

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "camera/backends/v4l2/v4l2_backend.hpp"
#include "camera/conformance/conformance.hpp"
#include "firmware/camera/umock_camera.hpp"

namespace lightwell::conformance {
namespace {

using test::DeviceKind;
using test::UmockCamera;

/// The device of the current test.
std::unique_ptr<UmockCamera>& plugged() {
  static std::unique_ptr<UmockCamera> one;
  return one;
}

BackendUnderTest camera_of(const std::string& name, const DeviceKind& kind, const std::string& parameters) {
  BackendUnderTest camera;
  camera.name = name;
  camera.make = [kind, parameters]() -> Result<std::unique_ptr<CameraBackend>> {
    plugged().reset();
    plugged() = std::make_unique<UmockCamera>(kind);
    const Result<CameraUri> uri =
        parse_camera_uri("v4l2:" + UmockCamera::path() + "?width=64&height=48&frame_rate=50" + parameters);
    if (!uri) return uri.status();
    return make_v4l2_backend(*uri, CameraConfig());
  };
  camera.disconnect = [] { plugged()->unplug(); };
  return camera;
}

std::vector<BackendUnderTest> cameras_of_all_kinds() {
  DeviceKind padded = test::webcam(V4L2_PIX_FMT_NV12);
  padded.padding = 32;
  padded.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  DeviceKind no_clock = test::webcam(V4L2_PIX_FMT_SRGGB10P);
  no_clock.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  DeviceKind few_buffers = test::webcam(V4L2_PIX_FMT_YUYV);
  few_buffers.most_buffers = 4;
  return {
      camera_of("yuyv", test::webcam(V4L2_PIX_FMT_YUYV), "&exposure=2ms&row_readout=50us"),
      camera_of("yuyv_bracket", test::webcam(V4L2_PIX_FMT_YUYV), "&exposure=1ms,8ms&control_delay=2"),
      camera_of("yuyv_copied", few_buffers, "&exposure=2ms"),
      camera_of("nv12", padded, "&exposure=2ms&row_readout=50us"),
      camera_of("bayer8_bggr", test::webcam(V4L2_PIX_FMT_SBGGR8), "&exposure=2ms"),
      camera_of("bayer10_packed", no_clock, "&exposure=2ms"),
      camera_of("mjpeg", test::webcam(V4L2_PIX_FMT_MJPEG), "&exposure=2ms"),
  };
}

INSTANTIATE_TEST_SUITE_P(V4l2, CameraConformance, cameras(cameras_of_all_kinds()), name_of);

}  // namespace
}  // namespace lightwell::conformance
