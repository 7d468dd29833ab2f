// The checks of the conformance suite, as functions that return violations. The suite runs them on every camera
// backend; a test of the suite runs them on cameras that are broken on purpose.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

[[nodiscard]] Violations check_sequence(const BackendUnderTest& camera);
[[nodiscard]] Violations check_times(const BackendUnderTest& camera);
[[nodiscard]] Violations check_views(const BackendUnderTest& camera);
[[nodiscard]] Violations check_exposures(const BackendUnderTest& camera);
[[nodiscard]] Violations check_one_thread(const BackendUnderTest& camera);
[[nodiscard]] Violations check_no_push_after_stop(const BackendUnderTest& camera);
[[nodiscard]] Violations check_restart(const BackendUnderTest& camera);
[[nodiscard]] Violations check_states(const BackendUnderTest& camera);
[[nodiscard]] Violations check_lifecycle_without_frames(const BackendUnderTest& camera);
[[nodiscard]] Violations check_held_across_stop(const BackendUnderTest& camera);
[[nodiscard]] Violations check_retaining_sink(const BackendUnderTest& camera);
[[nodiscard]] Violations check_release_on_other_thread(const BackendUnderTest& camera);
/// Applies to Pace::own with a declared frame rate; passes otherwise.
[[nodiscard]] Violations check_slow_sink(const BackendUnderTest& camera);
/// Applies if `frames` is set; passes otherwise.
[[nodiscard]] Violations check_end(const BackendUnderTest& camera);
/// Applies if `disconnect` is set; passes otherwise.
[[nodiscard]] Violations check_loss(const BackendUnderTest& camera);

struct Check {
  std::string_view name;  ///< Name of the function without "check_".
  Violations (*run)(const BackendUnderTest&);
};
/// All checks above.
[[nodiscard]] std::span<const Check> all_checks();

}  // namespace lightwell::conformance
