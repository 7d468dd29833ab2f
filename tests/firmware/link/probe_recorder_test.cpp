#include "link/recordings/probe_recorder.hpp"

#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <lightwell/time.hpp>

#include "support/plane_messages.hpp"
#include "support/temp_dir.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr RecordingAction kStart = RecordingAction::start, kStop = RecordingAction::stop;

EncodedDescriptor message(int number, std::size_t bytes = 100) {
  auto out = std::make_shared<std::vector<std::byte>>(bytes);
  out->front() = static_cast<std::byte>(number);
  return out;
}

class ProbeRecorderTest : public ::testing::Test {
 protected:
  [[nodiscard]] RecordingsConfig config() const { return {folder_.path("."), 1'000'000, 100, 1}; }
  [[nodiscard]] static RecordingHeader header(RecordingKind kind = RecordingKind::descriptors) {
    return {kind, "attic", "0.1.0", {}};
  }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path(".")))
      names.push_back(entry.path().filename().string());
    return names;
  }
  [[nodiscard]] std::vector<Record> records(const std::string& file) const {
    std::vector<Record> out;
    Result<RecordReader> reader = RecordReader::open(folder_.path(file));
    EXPECT_TRUE(reader.ok()) << reader.status().message();
    if (!reader.ok()) return out;
    EXPECT_EQ(reader->header().probe_name, "attic");
    for (Record record; reader->next(record);) out.push_back(record);
    return out;
  }
  /// The status after `action`, which must succeed.
  static RecordingStatus controlled(ProbeRecorder& recorder, RecordingAction action) {
    const Result<RecordingStatus> status = recorder.control(action);
    EXPECT_TRUE(status.ok()) << status.status().message();
    return status ? *status : RecordingStatus{};
  }
  static ::testing::AssertionResult ends(const ProbeRecorder& recorder) {
    return becomes_true("the recording has ended", [&] { return !recorder.status().running; });
  }

  TempDir folder_;
};

TEST_F(ProbeRecorderTest, WhatIsPublishedBetweenStartAndStopIsInTheFile) {
  ProbeRecorder recorder(config(), header());
  recorder.publish(message(1));
  const RecordingStatus started = controlled(recorder, kStart);
  EXPECT_TRUE(started.running);
  EXPECT_THAT(started.file, ::testing::MatchesRegex("[0-9]{8}T[0-9]{6}Z-0001[.]lwr"));
  const std::int64_t before = monotonic_now_ns();
  recorder.publish(message(2));
  recorder.publish(message(3));
  const std::int64_t after = monotonic_now_ns();
  const RecordingStatus stopped = controlled(recorder, kStop);
  recorder.publish(message(4));
  EXPECT_FALSE(stopped.running);
  EXPECT_EQ(stopped.descriptors, 2U);
  EXPECT_EQ(stopped.lost, 0U);
  EXPECT_EQ(stopped.end_reason, "");
  EXPECT_EQ(stopped.faults, 0U);
  EXPECT_EQ(stopped.bytes, std::filesystem::file_size(folder_.path(stopped.file)));
  EXPECT_THAT(files(), ElementsAre(stopped.file));
  const std::vector<Record> got = records(stopped.file);
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(got[0].payload, *message(2));
  EXPECT_EQ(got[1].payload, *message(3));
  EXPECT_TRUE(before <= got[0].time_ns && got[0].time_ns <= got[1].time_ns && got[1].time_ns <= after);
}

TEST_F(ProbeRecorderTest, OneRecordingAtATime) {
  ProbeRecorder recorder(config(), header());
  const Result<RecordingStatus> none = recorder.control(kStop);
  EXPECT_EQ(none.status().code(), StatusCode::failed_precondition);
  EXPECT_THAT(none.status().message(), HasSubstr("no recording runs"));
  const RecordingStatus first = controlled(recorder, kStart);
  const Result<RecordingStatus> twice = recorder.control(kStart);
  EXPECT_EQ(twice.status().code(), StatusCode::failed_precondition);
  EXPECT_THAT(twice.status().message(), HasSubstr(first.file));
  EXPECT_TRUE(recorder.status().running) << "the refusal does not disturb the recording";
  (void)controlled(recorder, kStop);
  const RecordingStatus second = controlled(recorder, kStart);
  EXPECT_NE(second.file, first.file);
  EXPECT_EQ(recorder.status().faults, 0U);
}

TEST_F(ProbeRecorderTest, ADestroyedRecorderKeepsWhatWasPublished) {
  {
    ProbeRecorder recorder(config(), header());
    (void)controlled(recorder, kStart);
    recorder.publish(message(1));
  }
  ASSERT_EQ(files().size(), 1U);
  EXPECT_EQ(records(files().front()).size(), 1U);
}

TEST_F(ProbeRecorderTest, AFolderThatCannotBeUsedIsRefusedWithTheRemedyAndWithoutItsPath) {
  (void)folder_.write("file", "");
  for (const std::string name : {"missing", "file"}) {
    RecordingsConfig bad = config();
    bad.folder = folder_.path(name);
    ProbeRecorder recorder(bad, header());
    const Result<RecordingStatus> refused = recorder.control(kStart);
    EXPECT_EQ(refused.status().code(), StatusCode::failed_precondition) << name;
    EXPECT_THAT(refused.status().message(), HasSubstr("change recordings.folder")) << name;
    EXPECT_THAT(refused.status().message(), Not(HasSubstr(folder_.path("")))) << name;
    EXPECT_EQ(recorder.check_folder().message(), refused.status().message());
    EXPECT_FALSE(recorder.status().running);
  }
}

TEST_F(ProbeRecorderTest, AThousandStartsMakeFewFiles) {
  ProbeRecorder recorder(config(), header());
  std::size_t started = 0;
  for (int i = 0; i < 1000; ++i) {
    const Result<RecordingStatus> status = recorder.control(kStart);
    if (status)
      ++started;
    else
      EXPECT_EQ(status.status().code(), StatusCode::resource_exhausted) << status.status().message();
    (void)recorder.control(kStop);
  }
  EXPECT_GE(started, 5U);
  EXPECT_LE(started, 6U) << "one in ten seconds";
  EXPECT_EQ(files().size(), started);
}

TEST_F(ProbeRecorderTest, TheSizeOfAllRecordingsIsLimited) {
  RecordingsConfig small = config();
  small.max_bytes = 10'000;
  (void)folder_.write("earlier.lwr", std::string(4000, 'x'));
  (void)folder_.write("other.txt", std::string(100'000, 'x'));
  ProbeRecorder recorder(small, header());
  const std::string file = controlled(recorder, kStart).file;
  for (int i = 0; i < 200 && recorder.status().running; ++i) {
    recorder.publish(message(i));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_TRUE(ends(recorder));
  EXPECT_THAT(recorder.status().end_reason, HasSubstr("max_bytes (10000)"));
  EXPECT_EQ(recorder.status().faults, 1U);
  const std::uintmax_t size = std::filesystem::file_size(folder_.path(file));
  EXPECT_LE(size, 6000U);
  EXPECT_GE(size, 5500U);
  EXPECT_EQ(records(file).size(), recorder.status().descriptors);
  EXPECT_EQ(recorder.control(kStop).status().code(), StatusCode::failed_precondition);
}

TEST_F(ProbeRecorderTest, AFullFolderOrDiskRefusesTheStart) {
  const auto refusal = [&](const RecordingsConfig& full) {
    ProbeRecorder recorder(full, header());
    const Status s = recorder.control(kStart).status();
    EXPECT_EQ(s.code(), StatusCode::resource_exhausted);
    return s.message();
  };
  (void)folder_.write("1.lwr", std::string(5000, 'x'));
  (void)folder_.write("2.lwr", std::string(5000, 'x'));
  RecordingsConfig full = config();
  full.max_bytes = 10'000;
  EXPECT_THAT(refusal(full), HasSubstr("recordings.max_bytes is 10000"));
  full = config();
  full.max_files = 2;
  EXPECT_THAT(refusal(full), HasSubstr("recordings.max_files is 2"));
  full = config();
  full.min_free_bytes = ~std::uint64_t{0};
  EXPECT_THAT(refusal(full), HasSubstr("recordings.min_free_bytes"));
  EXPECT_EQ(files().size(), 2U);
}

TEST_F(ProbeRecorderTest, ARemovedFileOrFolderEndsTheRecording) {
  RecordingsConfig inner = config();
  inner.folder = folder_.path("inner");
  std::filesystem::create_directory(inner.folder);
  ProbeRecorder recorder(inner, header());
  (void)controlled(recorder, kStart);
  std::filesystem::remove_all(inner.folder);
  ASSERT_TRUE(ends(recorder)) << "also while nothing is published";
  EXPECT_THAT(recorder.status().end_reason, HasSubstr("removed"));
  EXPECT_EQ(recorder.status().faults, 1U);
  EXPECT_EQ(recorder.control(kStart).status().code(), StatusCode::failed_precondition);
  std::filesystem::create_directory(inner.folder);
  EXPECT_TRUE(controlled(recorder, kStart).running) << "a repaired folder is used again";
  EXPECT_EQ(recorder.status().end_reason, "");
}

TEST_F(ProbeRecorderTest, AFullDiskEndsTheRecordingAndWhatWasWrittenIsReadable) {
  RecordingsConfig inner = config();
  inner.folder = folder_.path("disk");
  std::filesystem::create_directory(inner.folder);
  if (::mount("none", inner.folder.c_str(), "tmpfs", 0, "size=64k") != 0)
    GTEST_SKIP() << "only root may mount a small disk";
  {
    ProbeRecorder recorder(inner, header());
    const std::string file = controlled(recorder, kStart).file;
    for (int i = 0; i < 1000 && recorder.status().running; ++i) {
      recorder.publish(message(i, 1000));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(ends(recorder));
    EXPECT_THAT(recorder.status().end_reason, ::testing::AnyOf(HasSubstr("No space left"), HasSubstr("min_free")));
    EXPECT_EQ(recorder.status().faults, 1U);
    EXPECT_GE(records("disk/" + file).size(), 50U);
  }
  EXPECT_EQ(::umount(inner.folder.c_str()), 0);
}

TEST_F(ProbeRecorderTest, WhatIsTooFastForTheDiskIsCounted) {
  ProbeRecorder recorder(config(), header());
  (void)controlled(recorder, kStart);
  constexpr std::uint64_t kMessages = 5000;
  for (std::uint64_t i = 0; i < kMessages; ++i) recorder.publish(message(1));
  const RecordingStatus stopped = controlled(recorder, kStop);
  EXPECT_EQ(stopped.descriptors + stopped.lost, kMessages);
  EXPECT_GT(stopped.lost, 0U) << "the queue is bounded";
  EXPECT_EQ(records(stopped.file).size(), stopped.descriptors);
}

TEST_F(ProbeRecorderTest, APlaneBeginsWholeAndIsStoredOnlyIfTheHeaderSaysSo) {
  const auto names = [&](RecordingKind kind) {
    ProbeRecorder recorder(config(), header(kind));
    recorder.publish_plane(plane_update(1, 1, 2));
    const std::string file = controlled(recorder, kStart).file;
    recorder.publish_plane(plane_update(2, 1, 2));
    recorder.publish_plane(plane_update(3, 1, 2));
    const RecordingStatus stopped = controlled(recorder, kStop);
    EXPECT_EQ(stopped.descriptors, 0U);
    std::vector<std::string> out;
    for (const Record& record : records(file)) {
      EXPECT_EQ(record.message, RecordedMessage::plane);
      out.push_back(plane_name(record.payload));
    }
    return out;
  };
  EXPECT_THAT(names(RecordingKind::descriptors), ElementsAre());
  EXPECT_THAT(names(RecordingKind::descriptors_and_planes), ElementsAre("whole2.0", "whole2.1", "change3.0"));
}

TEST_F(ProbeRecorderTest, ClientsOfSeveralLinksMayStartAndStopAtTheSameTime) {
  ProbeRecorder recorder(config(), header());
  std::atomic<int> started{0}, stopped{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      for (int k = 0; k < 100; ++k) {
        if (recorder.control(kStart)) ++started;
        if (recorder.control(kStop)) ++stopped;
      }
    });
  for (int i = 0; i < 1000; ++i) recorder.publish(message(i));
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(started, 1);
  EXPECT_EQ(started, stopped) << "each started recording is stopped once";
  EXPECT_EQ(files().size(), static_cast<std::size_t>(started));
}

}  // namespace
}  // namespace lightwell::test
