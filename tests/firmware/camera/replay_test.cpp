// Tests of the replay backend beyond the conformance suite (replay_conformance_test.cpp).
#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>
#include <lightwell/recording.hpp>

#include "camera/backends/replay/replay_backend.hpp"
#include "firmware/camera/recordings.hpp"
#include "support/read_file.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;

Result<std::unique_ptr<CameraBackend>> make(const std::string& text) {
  const Result<CameraUri> uri = parse_camera_uri(text);
  if (!uri) return uri.status();
  return make_replay_backend(*uri, CameraConfig());
}

struct Played {
  FrameInfo info;
  std::vector<std::vector<std::byte>> pictures;
};

class Keeper final : public FrameSink {
 public:
  void push(Frame frame) override {
    Played played{frame.info, {}};
    for (const View& view : frame.views()) played.pictures.emplace_back(view.data.begin(), view.data.end());
    frames.push_back(std::move(played));
  }
  std::vector<Played> frames;
};

class Replay : public ::testing::Test {
 protected:
  std::vector<Played> play(const std::string& uri) {
    auto camera = make(uri);
    if (!camera) {
      ADD_FAILURE() << camera.status().message();
      return {};
    }
    const Result<CameraInfo> opened = (*camera)->open();
    if (!opened) {
      ADD_FAILURE() << opened.status().message();
      return {};
    }
    info = *opened;
    Keeper keeper;
    EXPECT_TRUE((*camera)->start(keeper).ok());
    for (int i = 0; i < 2000 && (*camera)->state() != CameraBackend::State::finished; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ((*camera)->state(), CameraBackend::State::finished);
    (*camera)->stop();
    return keeper.frames;
  }
  Status open_status(const std::string& uri) {
    auto camera = make(uri);
    return camera ? (*camera)->open().status() : camera.status();
  }

  test::TempDir scratch;
  std::string path = scratch.path("r.lwrec");
  MadeFrames made;
  CameraInfo info;
};

TEST_F(Replay, PicturesAndMetadataAreThoseOfTheRecording) {
  made.count = 9;
  made.exposure_s = {0.001, 0.004};
  write_recording(path, made, [](FrameRecord& f) {
    f.gain = 2;
    f.row_readout = {1500};
    return true;
  });
  const auto frames = play("replay:" + path + "?pace=fast");
  ASSERT_EQ(frames.size(), 9U);
  EXPECT_EQ(info.width, made.width);
  EXPECT_EQ(info.lenses, 2);
  EXPECT_EQ(info.format, PixelFormat::rgb8);
  EXPECT_EQ(info.exposure_s, made.exposure_s);
  EXPECT_EQ(info.frame_rate, 0) << "on demand";
  EXPECT_EQ(info.name, "replay:r.lwrec");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].info.sequence, i);
    EXPECT_EQ(frames[i].info.gain, 2);
    EXPECT_EQ(frames[i].info.row_readout.ns, 1500);
    EXPECT_EQ(frames[i].info.exposure_s, made.exposure_s[i % 2]);
    ASSERT_EQ(frames[i].pictures.size(), 2U);
    for (int lens = 0; lens < 2; ++lens)
      EXPECT_EQ(frames[i].pictures[static_cast<std::size_t>(lens)], made_picture(made, i, lens));
  }
}

TEST_F(Replay, AFolderOfPicturesPlaysAlike) {
  made.count = 4;
  const auto frames = play("replay:" + write_folder(scratch.path("folder"), made) + "/?pace=fast");
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(info.name, "replay:folder");
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (int lens = 0; lens < 2; ++lens)
      EXPECT_EQ(frames[i].pictures[static_cast<std::size_t>(lens)], made_picture(made, i, lens));
}

TEST_F(Replay, GapsOfTheRecordingAreKept) {
  made.count = 10;
  write_recording(path, made, [](FrameRecord& f) { return f.sequence != 3 && f.sequence != 4; });
  const auto frames = play("replay:" + path + "?pace=fast");
  ASSERT_EQ(frames.size(), 8U);
  EXPECT_EQ(frames[2].info.sequence, 2U);
  EXPECT_EQ(frames[3].info.sequence, 5U);
}

TEST_F(Replay, IntervalsAreRecordedAndTimesAreCurrent) {
  made.count = 12;
  made.rate = 50;
  write_recording(path, made, [](FrameRecord& f) { return f.sequence != 5; });
  const std::int64_t before = monotonic_now_ns();
  const auto frames = play("replay:" + path);
  ASSERT_FALSE(frames.empty());
  EXPECT_NEAR(info.frame_rate, 50, 1e-6);
  EXPECT_GE(frames.front().info.mid_exposure.ns, before);
  // On a busy machine frames may be dropped; the others must have the recorded intervals.
  for (const Played& frame : frames) {
    const auto steps = static_cast<double>(frame.info.sequence - frames[0].info.sequence);
    EXPECT_NEAR((frame.info.mid_exposure - frames[0].info.mid_exposure).seconds(), steps / 50, 0.02);
    EXPECT_GE(frame.info.delivered, frame.info.mid_exposure);
  }
}

TEST_F(Replay, SequenceNumbersIncreaseOverLoops) {
  made.count = 3;
  write_recording(path, made);
  const auto frames = play("replay:" + path + "?loop=3&pace=fast");
  ASSERT_EQ(frames.size(), 9U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].info.sequence, i);
    EXPECT_EQ(frames[i].pictures[0], made_picture(made, i % 3, 0));
  }
}

TEST_F(Replay, ADamagedTailEndsTheRecording) {
  made.count = 6;
  write_recording(path, made);
  const auto whole = test::read_bytes(path);
  const auto cut = scratch.write("cut.lwrec", std::span(whole).first(whole.size() - 100));
  EXPECT_EQ(play("replay:" + cut + "?pace=fast").size(), 5U);
  // Each loop plays the frames before the damage.
  EXPECT_EQ(play("replay:" + cut + "?loop=2&pace=fast").size(), 10U);
}

TEST_F(Replay, UnplayableFramesAreGaps) {
  made.count = 9;
  write_recording(path, made, [](FrameRecord& f) {
    if (f.sequence == 2) f.exposure_s = -1;
    if (f.sequence == 3) f.views.pop_back();
    if (f.sequence == 4) {
      for (RecordedView& view : f.views) view.height -= 2;
    }
    if (f.sequence == 6) f.views[0].data = f.views[0].data.first(f.views[0].data.size() - 1);
    if (f.sequence == 7) --f.views[0].stride;
    return true;
  });
  const auto frames = play("replay:" + path + "?pace=fast");
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[2].info.sequence, 5U);
  EXPECT_EQ(frames[3].info.sequence, 8U);
}

TEST_F(Replay, ADamagedPictureOfAFolderIsAGap) {
  made.count = 3;
  const std::string folder = write_folder(scratch.path("folder"), made);
  scratch.write("folder/1_0.png", std::string_view("\x89PNG"));
  const auto frames = play("replay:" + folder + "?pace=fast");
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].info.sequence, 2U);
}

TEST_F(Replay, PlaysAnAppendedRecordingContinuously) {
  made.count = 3;
  write_recording(path, made);
  write_recording(path, made);
  const auto frames = play("replay:" + path);
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_EQ(frames.back().info.sequence, 5U);
}

TEST_F(Replay, RefusesUnplayableFilesWithTheReason) {
  made.count = 1;
  const std::string folder = write_folder(scratch.path("folder"), made);
  EXPECT_EQ(open_status("replay:").code(), StatusCode::invalid_argument);
  EXPECT_EQ(open_status("replay:" + scratch.path("none")).code(), StatusCode::not_found);
  EXPECT_EQ(open_status("replay:" + scratch.path("")).code(), StatusCode::not_found);
  EXPECT_EQ(open_status("replay:" + scratch.write("text", std::string_view("hello"))).code(), StatusCode::data_loss);
  EXPECT_THAT(make("replay:x?loops=2").status().message(), HasSubstr("did you mean 'loop'?"));
  EXPECT_EQ(make("replay:x?loop=-1").status().code(), StatusCode::invalid_argument);
  EXPECT_EQ(make("replay:x?loop=").status().code(), StatusCode::invalid_argument);
  EXPECT_EQ(make("replay:x?pace=slow").status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(make("replay:x?exposure=1ms").status().message(), HasSubstr("no parameter 'exposure'"));
  CameraConfig config;
  config.capture.gain = 2;
  EXPECT_THAT(make_replay_backend(*parse_camera_uri("replay:x"), config).status().message(),
              HasSubstr("camera.gain: this camera has no gain"));

  RecordingHeader header;
  { ASSERT_TRUE(RecordWriter::open(scratch.path("d"), header).ok()); }
  EXPECT_THAT(open_status("replay:" + scratch.path("d")).message(), HasSubstr("descriptors"));
  header.kind = RecordingKind::frames;
  header.calibration = encode_calibration({});
  { ASSERT_TRUE(RecordWriter::open(scratch.path("c"), header).ok()); }
  EXPECT_THAT(open_status("replay:" + scratch.path("c")).message(), HasSubstr("the calibration in it is invalid"));
  made.count = 0;
  EXPECT_EQ(open_status("replay:" + write_recording(scratch.path("empty"), made)).code(), StatusCode::data_loss);

  scratch.write("folder/calibration.textproto", std::string_view("lens { colour: 3 }"));
  EXPECT_THAT(open_status("replay:" + folder).message(), HasSubstr("calibration.textproto"));
  scratch.write("folder/0_1.png", std::string_view("x"));
  EXPECT_EQ(open_status("replay:" + folder).code(), StatusCode::invalid_argument);
}

TEST_F(Replay, CallsInTheWrongOrderAreRefused) {
  made.count = 1;
  auto camera = make("replay:" + write_recording(path, made));
  ASSERT_TRUE(camera.ok());
  Keeper keeper;
  EXPECT_EQ((*camera)->start(keeper).code(), StatusCode::failed_precondition);
  ASSERT_TRUE((*camera)->open().ok());
  EXPECT_EQ((*camera)->open().status().code(), StatusCode::failed_precondition);
  EXPECT_TRUE((*camera)->start(keeper).ok());
  EXPECT_EQ((*camera)->start(keeper).code(), StatusCode::failed_precondition);
}

}  // namespace
}  // namespace lightwell
