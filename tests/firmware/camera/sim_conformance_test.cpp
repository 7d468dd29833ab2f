#include <ImathBox.h>

#include <OpenEXR/ImfRgbaFile.h>
#include <gtest/gtest.h>

#include "camera/backends/sim/sim_backend.hpp"
#include "camera/conformance/conformance.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::conformance {
namespace {

const test::TempDir& scratch() {
  static const test::TempDir made;
  return made;
}

/// A grey room with a lamp.
std::string panorama() {
  constexpr int kWidth = 64, kHeight = 32;
  std::vector<Imf::Rgba> pixels(kWidth * kHeight, Imf::Rgba(0.5F, 0.4F, 0.3F));
  for (int y = 4; y < 8; ++y)
    for (int x = 30; x < 34; ++x) pixels[static_cast<std::size_t>(y * kWidth + x)] = {90, 80, 70};
  const std::string path = scratch().path("room.exr");
  Imf::RgbaOutputFile file(path.c_str(), kWidth, kHeight, Imf::WRITE_RGB);
  file.setFrameBuffer(pixels.data(), 1, kWidth);
  file.writePixels(kHeight);
  return path;
}

std::function<Result<std::unique_ptr<CameraBackend>>()> sim_of(const std::string& rest, double rate) {
  return [rest, rate]() -> Result<std::unique_ptr<CameraBackend>> {
    const Result<CameraUri> uri = parse_camera_uri("sim:" + rest);
    if (!uri) return uri.status();
    CameraConfig config;
    config.width = 64;
    config.height = 64;
    config.frame_rate = rate;
    return make_sim_backend(*uri, config);
  };
}

std::vector<BackendUnderTest> sims() {
  const std::string room = panorama();
  const std::string bracket = "?rig=pair&frames=8&sensor=rgb8&yaw_rate=30deg/s&exposure=1ms,8ms";
  using enum BackendUnderTest::Pace;
  return {
      {"ideal", sim_of(room + "?rig=pair&frames=8&yaw_rate=30deg/s", 50), own},
      {"ideal_on_demand", sim_of(room + "?rig=pair&frames=8&yaw_rate=30deg/s", 0), on_demand},
      {"rgb8_bracket", sim_of(room + bracket, 50), own},
      {"rgb8_bracket_on_demand", sim_of(room + bracket, 0), on_demand},
      {"rgb8_at_rest", sim_of(room + "?rig=pair&sensor=rgb8", 50), own},
  };
}

INSTANTIATE_TEST_SUITE_P(Sim, CameraConformance, cameras(sims()), name_of);

}  // namespace
}  // namespace lightwell::conformance
