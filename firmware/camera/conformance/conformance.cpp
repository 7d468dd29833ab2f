#include "camera/conformance/conformance.hpp"

#include <ostream>

namespace lightwell::conformance {
namespace {

void expect_none(const Violations& violations) {
  // A fault often repeats in every frame: the first violations suffice.
  constexpr std::size_t kShown = 8;
  for (std::size_t i = 0; i < violations.size() && i < kShown; ++i) ADD_FAILURE() << violations[i];
  if (violations.size() > kShown) ADD_FAILURE() << "and " << violations.size() - kShown << " more like these";
}

}  // namespace

::testing::internal::ParamGenerator<BackendUnderTest> cameras(const std::vector<BackendUnderTest>& all) {
  return ::testing::ValuesIn(all);
}

std::string name_of(const ::testing::TestParamInfo<BackendUnderTest>& info) { return info.param.name; }

void PrintTo(const BackendUnderTest& camera, std::ostream* out) { *out << camera.name; }

// Tests may link this library without instantiating the suite.
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraConformance);

TEST_P(CameraConformance, SequenceRepeatsOrGoesBack) { expect_none(check_sequence(GetParam())); }

TEST_P(CameraConformance, TimesGoBackOrAreOfAnotherClock) { expect_none(check_times(GetParam())); }

TEST_P(CameraConformance, PicturesAreNotWhatWasDeclared) { expect_none(check_views(GetParam())); }

TEST_P(CameraConformance, ExposuresAreOutsideTheDeclaredCycle) { expect_none(check_exposures(GetParam())); }

TEST_P(CameraConformance, SeveralThreadsPush) { expect_none(check_one_thread(GetParam())); }

TEST_P(CameraConformance, FramesComeAfterStop) { expect_none(check_no_push_after_stop(GetParam())); }

TEST_P(CameraConformance, StartsOnlyOnce) { expect_none(check_restart(GetParam())); }

TEST_P(CameraConformance, StateIsWrong) { expect_none(check_states(GetParam())); }

TEST_P(CameraConformance, HangsWhereNothingWasStarted) { expect_none(check_lifecycle_without_frames(GetParam())); }

TEST_P(CameraConformance, HeldFramesChangeAcrossStop) { expect_none(check_held_across_stop(GetParam())); }

TEST_P(CameraConformance, LentMemoryIsWrittenToOrLossesAreHidden) { expect_none(check_retaining_sink(GetParam())); }

TEST_P(CameraConformance, ReleaseOnAnotherThreadIsLost) { expect_none(check_release_on_other_thread(GetParam())); }

TEST_P(CameraConformance, SlowSinkIsFollowedByABurst) {
  if (GetParam().pace == BackendUnderTest::Pace::on_demand) GTEST_SKIP() << "frames come on demand";
  expect_none(check_slow_sink(GetParam()));
}

TEST_P(CameraConformance, EndIsNotSeen) {
  if (GetParam().frames == 0) GTEST_SKIP() << "this camera never ends";
  expect_none(check_end(GetParam()));
}

TEST_P(CameraConformance, LossIsNotSeen) {
  if (!GetParam().disconnect) GTEST_SKIP() << "this camera cannot be disconnected by the test";
  expect_none(check_loss(GetParam()));
}

}  // namespace lightwell::conformance
