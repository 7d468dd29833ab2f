// What every camera backend is held to, as functions that list what is wrong: the conformance suite
// runs them, and a test of the suite runs them on cameras that are broken on purpose.
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

/// A camera and what may be expected of it.
struct BackendUnderTest {
  std::string name;  ///< Letters, digits and underscores: it becomes part of the tests' names.
  /// A new camera each time, not opened yet; the one before is gone by then.
  std::function<Result<std::unique_ptr<CameraBackend>>()> make;

  enum class Pace {
    own,    ///< Frames come at the camera's rate; it drops what nobody has room for.
    taken,  ///< Frames come as soon as there is room; none is dropped.
  };
  Pace pace = Pace::own;
  /// The camera ends by itself after so many frames, 0: never. At least kFramesWanted.
  std::uint64_t frames = 0;
  /// Takes the device away while it streams; empty where a test cannot.
  std::function<void()> lose = nullptr;
  /// What is waited for comes within this, or never; long, because build machines are busy.
  std::chrono::milliseconds timeout{6000};
};

/// So many frames a check looks at; at 30 per second that is 0.5 s.
inline constexpr int kFramesWanted = 16;

/// One sentence a violation, empty where there is none.
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
/// Only for Pace::own with a declared frame rate; nothing to find otherwise.
[[nodiscard]] Violations check_slow_sink(const BackendUnderTest& camera);
/// Only where `frames` is set; nothing to find otherwise.
[[nodiscard]] Violations check_end(const BackendUnderTest& camera);
/// Only where `lose` is set; nothing to find otherwise.
[[nodiscard]] Violations check_loss(const BackendUnderTest& camera);

struct Check {
  std::string_view name;  ///< The function's, without "check_".
  Violations (*run)(const BackendUnderTest&);
};
/// All of the above.
[[nodiscard]] std::span<const Check> all_checks();

}  // namespace lightwell::conformance
