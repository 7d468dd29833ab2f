#include <gtest/gtest.h>

#include "camera/backends/replay/replay_backend.hpp"
#include "camera/conformance/conformance.hpp"
#include "firmware/camera/recordings.hpp"

namespace lightwell::conformance {
namespace {

/// Created once, removed when the program ends.
const test::TempDir& scratch() {
  static const test::TempDir made;
  return made;
}

std::function<Result<std::unique_ptr<CameraBackend>>()> replay_of(const std::string& rest) {
  return [rest]() -> Result<std::unique_ptr<CameraBackend>> {
    const Result<CameraUri> uri = parse_camera_uri("replay:" + rest);
    if (!uri) return uri.status();
    return make_replay_backend(*uri, CameraConfig());
  };
}

std::vector<BackendUnderTest> make_replays() {
  const std::string plain = write_recording(scratch().path("plain.lwrec"), MadeFrames{});
  MadeFrames bracket;
  bracket.exposure_s = {0.0005, 0.004};
  const std::string bracketed = write_recording(scratch().path("bracket.lwrec"), bracket);
  MadeFrames few;
  few.count = 20;
  few.rate = 50;
  few.exposure_s = {0.001, 0.008};
  const std::string folder = write_folder(scratch().path("folder"), few);
  using enum BackendUnderTest::Pace;
  return {
      {"recording", replay_of(plain + "?loop=0"), own},
      {"recorded_bracket", replay_of(bracketed + "?loop=0"), own},
      {"recording_fast", replay_of(bracketed + "?loop=0&pace=fast"), on_demand},
      {"recording_once", replay_of(plain), own, 64},
      {"recording_once_fast", replay_of(plain + "?pace=fast"), on_demand, 64},
      {"folder", replay_of(folder + "?loop=0"), own},
      {"folder_twice_fast", replay_of(folder + "?loop=2&pace=fast"), on_demand, 40},
  };
}

/// Created once: Google Test calls it repeatedly, and an existing recording would be appended to.
const std::vector<BackendUnderTest>& replays() {
  static const std::vector<BackendUnderTest> made = make_replays();
  return made;
}

INSTANTIATE_TEST_SUITE_P(Replay, CameraConformance, cameras(replays()), name_of);

}  // namespace
}  // namespace lightwell::conformance
