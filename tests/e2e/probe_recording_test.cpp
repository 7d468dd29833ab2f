// Recordings that clients start on the probe.
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/recording.hpp>

#include "e2e/daemon.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class ProbeRecordingTest : public ::testing::Test {
 protected:
  ProbeRecordingTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }
  [[nodiscard]] DaemonOptions options(std::vector<std::string> more) const {
    return {.camera = "sim:" + folder_.path("room.exr") + "?yaw_rate=30deg/s", .more = std::move(more)};
  }
  /// A folder for recordings.
  [[nodiscard]] std::string make_folder() const {
    std::filesystem::create_directory(folder_.path("recordings"));
    return folder_.path("recordings");
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_.path("recordings")), {}));
  }

  TempDir folder_;
};

TEST_F(ProbeRecordingTest, HoldsWhatClientsReceivedByteForByte) {
  const std::string folder = make_folder();
  Daemon daemon(options({"--recordings", folder}));
  Observer observer(daemon.uri());
  const Result<RecordingStatus> started = observer.probe().start_recording();
  ASSERT_TRUE(started.ok()) << started.status().message();
  EXPECT_TRUE(started->running);
  ASSERT_TRUE(observer.gets(30));
  EXPECT_TRUE(becomes_true("the status has it", [&] {
    const std::optional<RecordingStatus> now = observer.probe().info().recording;
    return now && now->running && now->file == started->file && now->descriptors > 10 && now->bytes > 1000;
  }));
  const Result<RecordingStatus> stopped = observer.probe().stop_recording();
  ASSERT_TRUE(stopped.ok()) << stopped.status().message();
  EXPECT_FALSE(stopped->running);
  EXPECT_EQ(stopped->lost, 0U);

  const std::string file = folder + "/" + stopped->file;
  Result<RecordReader> reader = RecordReader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(reader->header().kind, RecordingKind::descriptors);
  const auto received = observer.bytes();
  std::size_t records = 0, both = 0;
  for (Record record; reader->next(record); ++records) {
    const Result<Descriptor> d = decode_descriptor(record.payload);
    ASSERT_TRUE(d.ok()) << d.status().message();
    const auto found = received.find(d->sequence);
    if (found == received.end()) continue;
    ++both;
    EXPECT_EQ(record.payload, found->second);
  }
  EXPECT_EQ(records, stopped->descriptors);
  EXPECT_GE(both, 20U);
  EXPECT_EQ(std::filesystem::file_size(file), stopped->bytes);
  const Observer again("replay:" + file + "?speed=0");
  EXPECT_TRUE(becomes_true("the SDK plays it", [&] { return again.count() == records; }));
}

TEST_F(ProbeRecordingTest, TheToolStartsAndStopsIt) {
  Daemon daemon(options({"--recordings", make_folder()}));
  const auto tool = [&](const std::string& command, int exit_code) {
    Child child(tool_command({"recording", command, daemon.uri()}));
    EXPECT_EQ(child.wait(), (ExitStatus{exit_code, 0})) << command << child.err();
    return child.out() + child.err();
  };
  EXPECT_THAT(tool("status", 0), HasSubstr("no recording since the probe's start"));
  EXPECT_THAT(tool("stop", 4), HasSubstr("no recording runs"));
  EXPECT_THAT(tool("start", 0), HasSubstr("recording 2"));
  EXPECT_THAT(tool("start", 4), HasSubstr("runs on the probe already"));
  EXPECT_THAT(tool("status", 0), HasSubstr("recording 2"));
  Child info(tool_command({"info", daemon.uri(), "--no-map"}));
  EXPECT_EQ(info.wait(), (ExitStatus{0, 0})) << info.err();
  EXPECT_THAT(info.out(), HasSubstr("recording    recording 2"));
  EXPECT_THAT(tool("stop", 0), HasSubstr("recorded 2"));
  EXPECT_EQ(files(), 1U);
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
}

TEST_F(ProbeRecordingTest, WithoutAFolderItIsRefusedWithTheRemedy) {
  Daemon daemon(options({}));
  Observer observer(daemon.uri());
  const Status refused = observer.probe().start_recording().status();
  EXPECT_EQ(refused.code(), StatusCode::failed_precondition);
  EXPECT_THAT(refused.message(), HasSubstr("set recordings { folder:"));
  EXPECT_FALSE(observer.probe().info().recording);
}

TEST_F(ProbeRecordingTest, AFolderThatIsMissingIsReportedAndUsedOnceItIsThere) {
  const std::string folder = folder_.path("recordings");
  Daemon daemon(options({"--recordings", folder}));
  Observer observer(daemon.uri());
  EXPECT_THAT(daemon.process().err(), HasSubstr("recordings in " + folder + ":")) << "in the log, with its path";
  const Status refused = observer.probe().start_recording().status();
  EXPECT_EQ(refused.code(), StatusCode::failed_precondition);
  EXPECT_THAT(refused.message(), Not(HasSubstr(folder))) << "clients do not see paths";
  (void)make_folder();
  EXPECT_TRUE(observer.probe().start_recording().ok());
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
  EXPECT_EQ(files(), 1U);
  Child check(daemon_command(options({"--check", "--recordings", folder + "/none"})));
  EXPECT_EQ(check.wait(), (ExitStatus{1, 0}));
  EXPECT_THAT(check.err(), HasSubstr(folder + "/none"));
}

TEST_F(ProbeRecordingTest, AFileThatCannotGrowEndsOnlyTheRecording) {
  DaemonOptions limited = options({"--recordings", make_folder()});
  limited.child.largest_file_bytes = 5000;
  Daemon daemon(limited);
  Observer observer(daemon.uri());
  ASSERT_TRUE(observer.probe().start_recording().ok());
  ASSERT_TRUE(becomes_true("the fault is counted", [&] {
    const std::optional<RecordingStatus> now = observer.probe().info().recording;
    return now && now->faults == 1 && !now->running && !now->end_reason.empty();
  }));
  ASSERT_TRUE(observer.gets(20)) << "the probe goes on";
  EXPECT_TRUE(becomes_true("it is logged", [&] { return occurrences(daemon.process().err(), "has ended:") == 1; }));
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
}

TEST_F(ProbeRecordingTest, AThousandRequestsMakeFewFilesAndDisturbNobody) {
  Daemon daemon(options({"--recordings", make_folder()}));
  Observer observer(daemon.uri());
  const Observer other(daemon.uri());
  ASSERT_TRUE(other.gets(5));
  for (int i = 0; i < 500; ++i) {
    (void)observer.probe().start_recording();
    (void)observer.probe().stop_recording();
  }
  EXPECT_LE(files(), 10U);
  EXPECT_GE(files(), 5U);
  EXPECT_TRUE(other.gets(5));
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
}

}  // namespace
}  // namespace lightwell::test
