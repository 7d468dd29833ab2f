// Tests of the conformance suite: each check detects the defect that it is intended for.
#include <algorithm>
#include <ostream>

#include <gtest/gtest.h>

#include "camera/conformance/conformance.hpp"
#include "firmware/camera/broken_camera.hpp"

namespace lightwell::conformance {
namespace {

std::atomic<bool> gone{false};

BackendUnderTest camera_with(Defect defect, std::uint64_t frames = 0) {
  BackendUnderTest camera;
  camera.name = "broken";
  camera.frames = frames;
  camera.make = [defect, frames]() -> Result<std::unique_ptr<CameraBackend>> {
    gone = false;
    return std::unique_ptr<CameraBackend>(std::make_unique<BrokenCamera>(defect, frames, gone));
  };
  camera.disconnect = [] { gone = true; };
  if (defect != Defect::none) camera.timeout = std::chrono::milliseconds(1000);
  return camera;
}

/// The camera without a defect passes all checks.
INSTANTIATE_TEST_SUITE_P(Sound, CameraConformance,
                         cameras({camera_with(Defect::none),
                                  [] {
                                    BackendUnderTest ending = camera_with(Defect::none, 64);
                                    ending.name = "ending";
                                    return ending;
                                  }()}),
                         name_of);

struct Case {
  const char* name;
  Defect defect;
  const char* check;
  std::uint64_t frames = 0;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class ConformanceSuite : public ::testing::TestWithParam<Case> {};

TEST_P(ConformanceSuite, FindsTheDefect) {
#ifdef __SANITIZE_THREAD__
  if (GetParam().defect == Defect::writes_to_lent_memory)
    GTEST_SKIP() << "the defect is a data race, which the thread sanitizer finds by itself";
#endif
  const auto checks = all_checks();
  const auto check = std::ranges::find(checks, GetParam().check, &Check::name);
  ASSERT_NE(check, checks.end()) << GetParam().check;
  EXPECT_FALSE(check->run(camera_with(GetParam().defect, GetParam().frames)).empty());
}

INSTANTIATE_TEST_SUITE_P(
    Defects, ConformanceSuite,
    ::testing::Values(Case{"repeats_sequence", Defect::repeats_sequence, "sequence"},
                      Case{"stands_still_in_time", Defect::stands_still_in_time, "times"},
                      Case{"stamps_the_future", Defect::stamps_the_future, "times"},
                      Case{"stamps_another_clock", Defect::stamps_another_clock, "times"},
                      Case{"is_smaller_than_declared", Defect::is_smaller_than_declared, "views"},
                      Case{"has_short_data", Defect::has_short_data, "views"},
                      Case{"lacks_a_lens", Defect::lacks_a_lens, "views"},
                      Case{"has_no_gain", Defect::has_no_gain, "exposures"},
                      Case{"leaves_the_cycle", Defect::leaves_the_cycle, "exposures"},
                      Case{"sticks_in_the_cycle", Defect::sticks_in_the_cycle, "exposures"},
                      Case{"pushes_from_two_threads", Defect::pushes_from_two_threads, "one_thread"},
                      Case{"pushes_from_start", Defect::pushes_from_start, "one_thread"},
                      Case{"pushes_after_stop", Defect::pushes_after_stop, "no_push_after_stop"},
                      Case{"starts_once", Defect::starts_once, "restart"},
                      Case{"stays_idle", Defect::stays_idle, "states"},
                      Case{"is_never_idle_again", Defect::is_never_idle_again, "states"},
                      Case{"writes_to_lent_memory", Defect::writes_to_lent_memory, "retaining_sink"},
                      Case{"clears_memory_at_stop", Defect::clears_memory_at_stop, "held_across_stop"},
                      Case{"hides_losses", Defect::hides_losses, "retaining_sink"},
                      Case{"lends_too_few", Defect::lends_too_few, "retaining_sink"},
                      Case{"lends_without_end", Defect::lends_without_end, "retaining_sink"},
                      Case{"forgets_releases", Defect::forgets_releases, "release_on_other_thread"},
                      Case{"catches_up_in_a_burst", Defect::catches_up_in_a_burst, "slow_sink"},
                      Case{"never_ends", Defect::never_ends, "end", 8},
                      Case{"does_not_see_its_loss", Defect::does_not_see_its_loss, "loss"}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace lightwell::conformance
