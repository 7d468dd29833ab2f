#include "usb_camera/commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hil/usb_camera/known_source.hpp"
#include "hil/usb_camera/video_host.hpp"

namespace lightwell::usb_camera {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class FakeCable final : public Cable {
 public:
  void unplug(bool close) override {
    in = false;
    closed = close;
  }
  void plug() override { in = true; }
  [[nodiscard]] bool plugged() const override { return in; }
  [[nodiscard]] bool host_there() const override { return true; }
  bool in = true, closed = false;
};

class CommandsTest : public ::testing::Test {
 protected:
  CommandsTest() {
    targets_.device = &device_;
    targets_.log = &log_;
    targets_.cable = &cable_;
    targets_.sink = &host_;
    targets_.set_scene = [this](const std::string& uri) {
      scene_ = uri;
      source_.automatic_s = 0.0055;
      return uri == "bad" ? Status(StatusCode::not_found, "no such scene") : Status();
    };
  }
  std::string say(const std::string& line) { return execute_command(line, targets_, {5'000'000'000}); }

  bench::KnownSource source_;
  FrameLog log_;
  Device device_{{.stream = {}, .formats = formats_for("single"), .payload_bytes = 0, .identity = {}}, source_, log_};
  FakeCable cable_;
  bench::VideoHost host_{100000, 16384};
  CommandTargets targets_;
  std::string scene_;
};

TEST_F(CommandsTest, FaultsAreCountsOfFrames) {
  EXPECT_EQ(say(R"({"command": "tear", "frames": 3})"), R"({"ok":true})");
  EXPECT_EQ(say(R"({"command": "shorten", "frames": 4})"), R"({"ok":true})");
  EXPECT_EQ(say(R"({"command": "mark", "frames": 5})"), R"({"ok":true})");
  EXPECT_EQ(say(R"({"command": "skip", "frames": 6})"), R"({"ok":true})");
  EXPECT_EQ(say(R"({"command": "silence", "seconds": 1.5})"), R"({"ok":true})");
  const Faults& faults = device_.stream().faults();
  EXPECT_EQ(faults.tear, 3U);
  EXPECT_EQ(faults.shorten, 4U);
  EXPECT_EQ(faults.mark, 5U);
  EXPECT_EQ(faults.skip, 6U);
  EXPECT_EQ(faults.silent_until, (CameraTime{6'500'000'000}));
  EXPECT_EQ(say(R"({"command": "stall"})"), R"({"ok":true})");
  EXPECT_TRUE(device_.stream().halted());
}

TEST_F(CommandsTest, UnplugsAndPlugs) {
  EXPECT_EQ(say(R"({"command": "unplug"})"), R"({"ok":true})");
  EXPECT_FALSE(cable_.in);
  EXPECT_FALSE(cable_.closed);
  EXPECT_THAT(say(R"({"command": "unplug"})"), HasSubstr("already"));
  EXPECT_EQ(say(R"({"command": "plug"})"), R"({"ok":true})");
  EXPECT_THAT(say(R"({"command": "plug"})"), HasSubstr("already"));
  EXPECT_EQ(say(R"({"command": "unplug", "how": "close"})"), R"({"ok":true})");
  EXPECT_TRUE(cable_.closed);
  cable_.in = true;
  EXPECT_THAT(say(R"({"command": "unplug", "how": "gently"})"), StartsWith(R"({"ok":false)"));
  EXPECT_TRUE(cable_.in);
}

TEST_F(CommandsTest, ResetsCounters) {
  FrameRecord torn;
  torn.outcome = Outcome::torn;
  log_.add(torn);
  EXPECT_THAT(say(R"({"command": "counters"})"), HasSubstr(R"("torn":1)"));
  EXPECT_THAT(say(R"({"command": "reset_counters"})"), HasSubstr(R"("torn":1)")) << "the values before the reset";
  EXPECT_THAT(say(R"({"command": "counters"})"), HasSubstr(R"("torn":0)"));
}

TEST_F(CommandsTest, ReportsFramesAndStatus) {
  for (std::uint64_t n = 0; n < 5; ++n) {
    FrameRecord record;
    record.number = n;
    log_.add(record);
  }
  const std::string frames = say(R"({"command": "frames", "last": 2})");
  EXPECT_THAT(frames, HasSubstr(R"("number":3)"));
  EXPECT_THAT(frames, HasSubstr(R"("number":4)"));
  EXPECT_THAT(frames, ::testing::Not(HasSubstr(R"("number":2)")));
  const std::string status = say(R"({"command": "status"})");
  EXPECT_THAT(status, HasSubstr(R"("plugged":true)"));
  EXPECT_THAT(status, HasSubstr(R"("exposure_s":0.0023)"));
  EXPECT_THAT(status, HasSubstr(R"("now_ns":5000000000)"));
}

TEST_F(CommandsTest, ANewSceneUpdatesAutomaticExposure) {
  EXPECT_EQ(say(R"({"command": "scene", "uri": "sim:night"})"), R"({"ok":true})");
  EXPECT_EQ(scene_, "sim:night");
  EXPECT_DOUBLE_EQ(device_.controls().settings().exposure_s, 0.0055);
  EXPECT_EQ(say(R"({"command": "scene", "uri": "bad"})"), R"({"ok":false,"error":"no such scene"})");
}

TEST_F(CommandsTest, ErrorsNameTheProblem) {
  EXPECT_THAT(say("tear 3"), HasSubstr("parse error at line 1, column 2"));
  for (const char* bad : {"", "{", "[]", "7", "{}", R"({"command": 1})", R"({"command": "tear", "frames": 3} x)",
                          R"({"command": "tear", "frames": "3"})", R"({"command": "tear", "frames": 1e999})"})
    EXPECT_THAT(say(bad), StartsWith(R"({"ok":false,"error":")")) << bad;
  EXPECT_THAT(say("{}"), HasSubstr("command"));
  EXPECT_THAT(say(R"({"command": "taer"})"), HasSubstr("did you mean 'tear'"));
  EXPECT_THAT(say("{\"command\": \"\xFF\"}"), StartsWith(R"({"ok":false,"error":")"));
  EXPECT_THAT(say(R"({"command": "tear", "frame": 3})"), HasSubstr(R"(no \"frame\")"));
  EXPECT_THAT(say(R"({"command": "tear"})"), HasSubstr("whole number"));
  EXPECT_THAT(say(R"({"command": "tear", "frames": 1.5})"), HasSubstr("whole number"));
  EXPECT_THAT(say(R"({"command": "tear", "frames": -1})"), HasSubstr("whole number"));
  EXPECT_THAT(say(R"({"command": "silence", "seconds": 1e9})"), HasSubstr("3600"));
  EXPECT_EQ(device_.stream().faults().tear, 0U);
}

TEST_F(CommandsTest, HelpNamesEachCommand) {
  const std::string help = say(R"({"command": "help"})");
  for (const char* name : {"counters", "frames", "mark", "plug", "reset_counters", "scene", "shorten", "silence",
                           "skip", "stall", "status", "tear", "unplug"})
    EXPECT_THAT(help, HasSubstr("\"" + std::string(name) + "\""));
}

}  // namespace
}  // namespace lightwell::usb_camera
