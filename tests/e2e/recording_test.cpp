// Recordings of frames and of descriptors reproduce the original descriptors.
#include <csignal>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/recording.hpp>

#include "e2e/daemon.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

class RecordingTest : public ::testing::Test {
 protected:
  RecordingTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }
  [[nodiscard]] std::string camera(const std::string& query) const { return "sim:" + folder_.path("room.exr") + query; }

  /// Compares the descriptors of captures that both received; returns their number.
  static std::size_t compare(const std::vector<Descriptor>& a, const std::vector<Descriptor>& b) {
    std::map<std::uint64_t, const Descriptor*> by_sequence;
    for (const Descriptor& d : a) by_sequence[d.sequence] = &d;
    std::size_t both = 0;
    for (const Descriptor& d : b) {
      const auto found = by_sequence.find(d.sequence);
      if (found == by_sequence.end()) continue;
      const Descriptor& original = *found->second;
      ++both;
      EXPECT_EQ(d.radiance, original.radiance) << "capture " << d.sequence;
      EXPECT_EQ(d.lights, original.lights) << "capture " << d.sequence;
      EXPECT_EQ(d.bound, original.bound) << "capture " << d.sequence;
      EXPECT_EQ(d.flags, original.flags) << "capture " << d.sequence;
      EXPECT_EQ(d.calibration_id, original.calibration_id);
    }
    return both;
  }

  /// Records frames while one client is connected, then replays them to another. Temporal filtering gives the same
  /// result only if no capture is lost, so the frame rates are low enough for a busy machine.
  void records_and_replays(const DaemonOptions& original, std::size_t captures) {
    const std::string file = folder_.path("frames.lwrec");
    DaemonOptions recording = original;
    recording.more = {"--record", file};
    Daemon daemon(recording);
    const Observer live(daemon.uri());
    ASSERT_TRUE(live.gets(captures)) << daemon.process().err();
    ASSERT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();

    Daemon player({.camera = "replay:" + file});
    const Observer again(player.uri());
    ASSERT_EQ(player.process().wait(), (ExitStatus{0, 0})) << "the replay ends with the recording";
    EXPECT_THAT(player.process().err(), HasSubstr("come to its end"));
    EXPECT_GE(compare(live.descriptors(), again.descriptors()), captures / 2);
    const std::vector<Descriptor> replayed = again.descriptors();
    ASSERT_FALSE(replayed.empty());
    EXPECT_GE(replayed.back().sequence, live.descriptors().back().sequence)
        << "the end of the recording reaches the client, too";
  }

  TempDir folder_;
};

TEST_F(RecordingTest, ReplayedFramesGiveTheSameDescriptors) {
  records_and_replays({.camera = camera("?yaw_rate=30deg/s&sensor=rgb8"), .frame_rate = 15}, 60);
}

TEST_F(RecordingTest, ReplayedBracketsGiveTheSameDescriptors) {
  records_and_replays(
      {.camera = camera("?yaw_rate=30deg/s&sensor=rgb8"), .frame_rate = 24, .exposure_s = {0.00002, 0.0005, 0.01}}, 40);
}

TEST_F(RecordingTest, ReplayedIdealFramesGiveTheSameDescriptors) {
  records_and_replays({.camera = camera("?yaw_rate=30deg/s"), .frame_rate = 15}, 30);
}

TEST_F(RecordingTest, AFullDiskEndsOnlyTheRecording) {
  const std::string file = folder_.path("frames.lwrec");
  DaemonOptions options{.camera = camera("?sensor=rgb8"), .more = {"--record", file}};
  options.child.largest_file_bytes = 1'000'000;  // About eight frames.
  Daemon daemon(options);
  const Observer observer(daemon.uri());
  ASSERT_TRUE(becomes_true("the fault is counted", [&] { return observer.counters().recording_faults > 0; }));
  ASSERT_TRUE(observer.gets(40)) << "the probe goes on";
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
  const std::string said = daemon.process().err();
  EXPECT_EQ(occurrences(said, "the probe goes on without it"), 1U) << said;
  EXPECT_THAT(said, HasSubstr(file));

  Result<RecordReader> reader = RecordReader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  Record record;
  int frames = 0;
  while (reader->next(record)) ++frames;
  EXPECT_GE(frames, 3) << "frames written before are readable";
}

TEST_F(RecordingTest, TheToolRecordsDescriptorsByteForByte) {
  const std::string file = folder_.path("evening.lwr");
  Daemon daemon({.camera = camera("?yaw_rate=30deg/s")});
  const Observer observer(daemon.uri());
  Child tool(tool_command({"record", daemon.uri(), file}));
  ASSERT_TRUE(becomes_true("the tool is a client", [&] { return observer.counters().clients == 2; }));
  ASSERT_TRUE(observer.gets(30));
  tool.signal(SIGTERM);
  ASSERT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();

  Result<RecordReader> reader = RecordReader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(reader->header().kind, RecordingKind::descriptors);
  EXPECT_EQ(reader->header().probe_name, "lightwell");
  const auto seen = observer.bytes();
  Record record;
  std::size_t records = 0, both = 0;
  std::uint64_t last = 0;
  for (; reader->next(record); ++records) {
    const Result<Descriptor> d = decode_descriptor(record.payload);
    ASSERT_TRUE(d.ok()) << d.status().message();
    last = d->sequence;
    const auto found = seen.find(d->sequence);
    if (found == seen.end()) continue;
    ++both;
    EXPECT_EQ(record.payload, found->second) << "capture " << d->sequence;
  }
  EXPECT_EQ(reader->torn_bytes(), 0U);
  EXPECT_GE(both, 20U);

  Child replay(tool_command({"replay", file}));
  ASSERT_EQ(replay.wait(), (ExitStatus{0, 0})) << replay.err();
  EXPECT_EQ(occurrences(replay.out(), "\n"), records) << "one line per descriptor";
  EXPECT_THAT(replay.out(), HasSubstr("#" + std::to_string(last) + " "));
  Child json(tool_command({"replay", file, "--json"}));
  ASSERT_EQ(json.wait(), (ExitStatus{0, 0}));
  EXPECT_EQ(occurrences(json.out(), "\"sequence\""), records);
}

TEST_F(RecordingTest, ARecordingOfDescriptorsIsRejectedAsACamera) {
  const std::string file = folder_.path("evening.lwr");
  {
    Result<RecordWriter> writer = RecordWriter::open(file, {RecordingKind::descriptors, "attic", "0.1.0", {}});
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->flush().ok());
  }
  Child child(daemon_command({.camera = "replay:" + file}));
  EXPECT_EQ(child.wait(), (ExitStatus{1, 0}));
  EXPECT_THAT(child.err(), HasSubstr("a recording of descriptors"));
}

}  // namespace
}  // namespace lightwell::test
