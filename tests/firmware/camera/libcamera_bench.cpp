// Runs the conformance suite on a real libcamera camera. Not a ctest test, because machines without a camera could only
// skip it. LIGHTWELL_LIBCAMERA_ID names the camera, or two separated by a comma.
#include <cstdlib>
#include <iostream>

#include <gtest/gtest.h>

#include "camera/backends/libcamera/libcamera_backend.hpp"
#include "camera/conformance/conformance.hpp"

namespace lightwell::conformance {
namespace {

const char* id() { return std::getenv("LIGHTWELL_LIBCAMERA_ID"); }

std::function<Result<std::unique_ptr<CameraBackend>>()> camera(std::vector<double> exposure_s) {
  return [exposure_s]() -> Result<std::unique_ptr<CameraBackend>> {
    const Result<CameraUri> uri = parse_camera_uri(std::string("libcamera:") + id());
    if (!uri) return uri.status();
    CameraConfig config;
    config.capture.exposure_s = exposure_s;
    return make_libcamera_backend(*uri, config);
  };
}

std::vector<BackendUnderTest> cameras_of_the_bench() {
  if (id() == nullptr) return {};
  std::vector<BackendUnderTest> all(2);
  all[0].name = "one_exposure";
  all[0].make = camera({0.01});
  all[1].name = "bracket";
  all[1].make = camera({0.002, 0.02});
  // Real cameras start slowly, especially on an emulated board.
  for (BackendUnderTest& b : all) b.timeout = std::chrono::seconds(30);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Bench, CameraConformance, cameras(cameras_of_the_bench()), name_of);

}  // namespace
}  // namespace lightwell::conformance

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (lightwell::conformance::id() == nullptr) {
    std::cerr
        << "libcamera_bench: set LIGHTWELL_LIBCAMERA_ID to a camera's id or number, as `cam --list` prints them\n";
    return 2;
  }
  return RUN_ALL_TESTS();
}
