// The OpenXR sample as a process: Debian's loader, a recording of a probe, and a runtime, whole, in parts, or none.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/recording.hpp>

#include "host_sdk/scenes.hpp"
#include "support/child.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class OpenXrLight : public ::testing::Test {
 protected:
  void SetUp() override {
    Descriptor scene = test::one_light({1, 0, 0}, {3, 2, 1});
    scene.sequence = 41;
    scene.time.mid_exposure.ns = 20'000'000;
    Result<RecordWriter> writer =
        RecordWriter::open(folder_.path("recording"), {RecordingKind::descriptors, "attic", "0.1.0", {}});
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    const std::string bytes = test::encoded(scene);
    ASSERT_TRUE(writer->append(1'000'000, test::as_bytes(bytes)).ok());
    ASSERT_TRUE(writer->flush().ok());
    manifest_ = folder_.write("runtime.json", std::string(R"({"file_format_version": "1.0.0", "runtime": )") +
                                                  R"({"library_path": ")" SIMULATED_XR_RUNTIME R"("}})");
  }

  struct Outcome {
    test::ExitStatus exit_status;
    std::string out, err;
  };

  /// `lacks`: parts that the runtime does not have; "runtime" for no runtime.
  [[nodiscard]] Outcome run(std::vector<std::string> arguments, const std::string& lacks = "") const {
    arguments.insert(arguments.begin(), OPENXR_LIGHT);
    test::ChildOptions options;
    options.environment = {"XR_RUNTIME_JSON=" + (lacks == "runtime" ? folder_.path("nowhere.json") : manifest_),
                           "SIMULATED_XR_LACKS=" + lacks,
                           // Overrides this process's options: the leaks are the loader's.
                           "LSAN_OPTIONS=print_suppressions=0:suppressions=" LSAN_SUPPRESSIONS};
    test::Child child(arguments, options);
    const test::ExitStatus exit_status = child.wait();
    return {exit_status, child.out(), child.err()};
  }

  [[nodiscard]] std::string uri() const { return "replay:" + folder_.path("recording") + "?speed=0"; }

  test::TempDir folder_;
  std::string manifest_;
};

constexpr test::ExitStatus kDone{0, 0};

TEST_F(OpenXrLight, GivesLightInWorldAndViewSpace) {
  const Outcome o = run({uri(), "--frames", "2", "--require-session"});
  EXPECT_EQ(o.exit_status, kDone) << o.out << o.err;
  EXPECT_THAT(o.out, HasSubstr("OpenXR runtime: simulated 4.2"));
  EXPECT_THAT(o.out, HasSubstr("world space: STAGE"));
  EXPECT_THAT(o.out, Not(HasSubstr("missing")));
  EXPECT_THAT(o.out, HasSubstr("frame 1, descriptor 41"));
  // The light is to the right of the stage; the head looks to the left, so the light is behind it.
  const std::size_t world = o.out.find("  world:"), view = o.out.find("  view:");
  ASSERT_NE(world, std::string::npos);
  ASSERT_NE(view, std::string::npos) << "the head was never located";
  EXPECT_THAT(o.out.substr(world, view - world), HasSubstr("directional VALID, direction 1.0000 0.0000 0.0000"));
  EXPECT_THAT(o.out.substr(view), HasSubstr("0.0000 1.0000, intensity 3.0000 2.0000 1.0000"));
}

TEST_F(OpenXrLight, ConvertsToTheRuntimesTime) {
  const Outcome o = run({uri()});
  const std::string word = "lastUpdatedTime ";
  const std::size_t at = o.out.find(word);
  ASSERT_NE(at, std::string::npos) << o.out;
  // The simulated clock is 5e18 ns ahead of the machine's.
  EXPECT_GT(std::stoll(o.out.substr(at + word.size())), 5'000'000'000'000'000'000);
}

TEST_F(OpenXrLight, RotatesTheLightByTheProbesPose) {
  // The probe hangs upside down: half a turn about its forward axis. Its right is the world's left.
  const Outcome o = run({uri(), "--world-probe", "0,0,1,0"});
  EXPECT_EQ(o.exit_status, kDone);
  EXPECT_THAT(o.out, HasSubstr("directional VALID, direction -1.0000"));
}

TEST_F(OpenXrLight, TotalHarmonicsExcludeADirectionalLight) {
  const Outcome o = run({uri(), "--total"});
  EXPECT_THAT(o.out, HasSubstr("harmonics VALID, TOTAL"));
  EXPECT_THAT(o.out, HasSubstr("directional INVALID"));
  EXPECT_THAT(o.out, HasSubstr("0.8463 0.5642 0.2821")) << "the light is in band 0: 0.282095 times 3, 2, 1";
}

TEST_F(OpenXrLight, ReportsMissingPartsAndStillGivesLight) {
  const struct {
    const char *lacks, *says;
  } cases[] = {{"runtime", "no OpenXR runtime"},
               {"headless", "XR_MND_headless"},
               {"headset", "XR_ERROR_FORM_FACTOR_UNAVAILABLE"},
               {"session", "xrCreateSession: XR_ERROR_RUNTIME_FAILURE"},
               {"timespec", "XR_KHR_convert_timespec_time"}};
  for (const auto& c : cases) {
    const Outcome o = run({uri()}, c.lacks);
    EXPECT_EQ(o.exit_status, kDone) << c.lacks << o.err;
    EXPECT_THAT(o.out, HasSubstr("missing: ")) << c.lacks;
    EXPECT_THAT(o.out, HasSubstr(c.says));
    EXPECT_THAT(o.out, HasSubstr("directional VALID, direction 1.0000 0.0000 0.0000")) << c.lacks;
    EXPECT_THAT(o.out, Not(HasSubstr("  view:"))) << c.lacks;
  }
}

TEST_F(OpenXrLight, UsesLocalWithoutAStage) {
  const Outcome o = run({uri()}, "stage");
  EXPECT_EQ(o.exit_status, kDone);
  EXPECT_THAT(o.out, HasSubstr("world space: LOCAL"));
}

TEST_F(OpenXrLight, HasAnExitStatusForEachFailure) {
  EXPECT_EQ(run({uri(), "--require-session"}, "headset").exit_status, (test::ExitStatus{3, 0}));
  EXPECT_EQ(run({"replay:" + folder_.path("nothing")}).exit_status, (test::ExitStatus{1, 0}));
  for (const std::vector<std::string>& misuse : {std::vector<std::string>{},
                                                 {uri(), "--frames"},
                                                 {uri(), "--frames", "x"},
                                                 {uri(), "--world-probe", "0,0,0,0"},
                                                 {uri(), "--world-probe", "1,2,3"},
                                                 {uri(), "another"},
                                                 {"--unknown"}})
    EXPECT_EQ(run(misuse).exit_status, (test::ExitStatus{2, 0}));
}

}  // namespace
}  // namespace lightwell
