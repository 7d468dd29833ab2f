// The conformance suite that every camera backend must pass. In the backend's test:
//   using lightwell::conformance::CameraConformance;
//   INSTANTIATE_TEST_SUITE_P(Replay, CameraConformance, conformance::cameras({{"recording", make_recording}}),
//                            conformance::name_of);
// The checks return violations, so that a test of the suite can run them on cameras that are broken on purpose.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/result.hpp>

#include "camera/backend.hpp"

namespace lightwell::conformance {

/// A camera backend and its expected behaviour.
struct BackendUnderTest {
  std::string name;  ///< Part of the test names: letters, digits and underscores.
  /// Makes a camera that is not open yet. The previous one has been destroyed by then.
  std::function<Result<std::unique_ptr<CameraBackend>>()> make;

  enum class Pace {
    own,        ///< Frames come at the camera's rate; it drops frames if no buffer is free.
    on_demand,  ///< Frames come as soon as the sink has space; none is dropped.
  };
  Pace pace = Pace::own;
  /// Number of frames after which the camera ends by itself, at least kFramesWanted; 0: it never ends.
  std::uint64_t frames = 0;
  /// Disconnects the device while it streams; empty if the test cannot do that.
  std::function<void()> disconnect = nullptr;
  /// Timeout of each wait; generous, because build machines are busy.
  std::chrono::milliseconds timeout{6000};
};

/// Number of frames that a check examines: 0.5 s at 30 frames per second.
inline constexpr int kFramesWanted = 16;

/// One sentence per violation; empty if the camera passes.
using Violations = std::vector<std::string>;

struct Check {
  std::string name;
  std::string fault;  ///< That it detects; names its test.
  Violations (*run)(const BackendUnderTest&);
  /// Whether the check is meant for this kind of camera; null: for all.
  bool (*applies)(const BackendUnderTest&) = nullptr;
};
/// All checks of README.md.
[[nodiscard]] std::vector<Check> all_checks();

struct CheckOfBackend {
  BackendUnderTest camera;
  Check check;
};

/// One test per camera and check.
class CameraConformance : public ::testing::TestWithParam<CheckOfBackend> {};

/// Parameters of the suite. A function of this library, so that the linker includes the suite's tests.
[[nodiscard]] ::testing::internal::ParamGenerator<CheckOfBackend> cameras(const std::vector<BackendUnderTest>& all);

/// Test name suffix: the camera and the fault.
[[nodiscard]] std::string name_of(const ::testing::TestParamInfo<CheckOfBackend>& info);

void PrintTo(const CheckOfBackend& tested, std::ostream* out);

}  // namespace lightwell::conformance
