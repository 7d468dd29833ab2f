#include "camera/frame_recorder.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <new>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "firmware/camera/recordings.hpp"

namespace {
std::atomic<int> allocations{0};
}  // namespace

// Counts all allocations of the program, including those of the recorder's thread. Not inlined: GCC would warn of the
// mismatched pairs new and free, malloc and delete.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace lightwell {
namespace {

using ::testing::HasSubstr;

/// Owner of the frames and final sink; counts releases and pushes.
class Ends final : public FrameOwner, public FrameSink {
 public:
  void release(int) override { ++released; }
  void push(Frame frame) override {
    last = frame.info.sequence;
    ++pushed;
  }
  int released = 0, pushed = 0;
  std::uint64_t last = 0;
};

class Recorder : public ::testing::Test {
 protected:
  Frame frame(std::uint64_t sequence) {
    for (std::size_t lens = 0; lens < 2; ++lens) pictures[lens] = made_picture(made, sequence, static_cast<int>(lens));
    Frame f(ends, 0);
    f.info.sequence = sequence;
    f.info.mid_exposure = {static_cast<std::int64_t>(1000 + sequence)};
    f.info.exposure_s = 0.002;
    f.info.gain = 1.5;
    f.info.row_readout = {77};
    f.info.bracket_index = 1;
    f.info.bracket_size = 3;
    for (int lens = 0; lens < 2; ++lens)
      f.add_view({lens, PixelFormat::rgb8, made.width, made.height, packed_stride(PixelFormat::rgb8, made.width),
                  pictures[static_cast<std::size_t>(lens)]});
    return f;
  }
  std::unique_ptr<FrameRecorder> open(int queue) {
    auto recorder = FrameRecorder::open(path, RecordingHeader(), ends, queue);
    EXPECT_TRUE(recorder.ok()) << recorder.status().message();
    return recorder ? std::move(*recorder) : nullptr;
  }
  /// Number of complete frames in the file; compares each with the pushed one.
  int frames_in_file() {
    auto reader = RecordReader::open(path);
    EXPECT_TRUE(reader.ok()) << reader.status().message();
    if (!reader) return -1;
    EXPECT_EQ(reader->header().kind, RecordingKind::frames);
    Record record;
    DecodedFrame decoded;
    int count = 0;
    for (; reader->next(record); ++count) {
      EXPECT_TRUE(decoded.decode(record.payload).ok());
      const FrameRecord& f = decoded.frame;
      EXPECT_GT(record.time_ns, 0);
      EXPECT_EQ(f.mid_exposure.ns, static_cast<std::int64_t>(1000 + f.sequence));
      EXPECT_EQ(f.gain, 1.5);
      EXPECT_EQ(f.exposure_s, 0.002);
      EXPECT_EQ(f.row_readout.ns, 77);
      EXPECT_EQ(f.bracket_index, 1);
      EXPECT_EQ(f.bracket_size, 3);
      EXPECT_EQ(f.views.size(), 2U);
      for (const RecordedView& v : f.views)
        EXPECT_EQ(std::vector(v.data.begin(), v.data.end()), made_picture(made, f.sequence, v.lens));
    }
    return count;
  }

  test::TempDir scratch;
  std::string path = scratch.path("out.lwrec");
  MadeFrames made;
  std::array<std::vector<std::byte>, 2> pictures;
  Ends ends;
};

TEST_F(Recorder, EachFrameIsForwardedAndWritten) {
  {
    const auto recorder = open(64);
    for (std::uint64_t i = 0; i < 40; ++i) {
      recorder->push(frame(i));
      EXPECT_EQ(ends.last, i);
      // The recorder has its own copy, so the camera's memory is released at once.
      EXPECT_EQ(ends.released, static_cast<int>(i + 1));
    }
    EXPECT_TRUE(recorder->finish().ok());
    EXPECT_EQ(recorder->recorded(), 40U);
    EXPECT_EQ(recorder->skipped(), 0U);
    EXPECT_EQ(recorder->faults(), 0U);
    recorder->push(frame(40));
    EXPECT_EQ(ends.pushed, 41) << "frames are still forwarded";
    EXPECT_EQ(recorder->skipped(), 1U);
    EXPECT_TRUE(recorder->finish().ok());
  }
  EXPECT_EQ(frames_in_file(), 40);
}

TEST_F(Recorder, FramesBeyondTheQueueAreSkippedAndCounted) {
  made.width = 800;
  made.height = 600;
  {
    const auto recorder = open(1);
    for (std::uint64_t i = 0; i < 30; ++i) recorder->push(frame(i));
    EXPECT_TRUE(recorder->finish().ok());
    EXPECT_EQ(recorder->recorded() + recorder->skipped(), 30U);
    EXPECT_GE(recorder->recorded(), 1U);
    EXPECT_EQ(ends.pushed, 30);
    EXPECT_EQ(frames_in_file(), static_cast<int>(recorder->recorded()));
  }
}

TEST_F(Recorder, NoAllocationAfterTheQueueWasFilledOnce) {
  const auto recorder = open(1);
  const auto record = [&](std::uint64_t sequence, int& counted) {
    Frame f = frame(sequence);
    const int before = allocations;
    recorder->push(std::move(f));
    while (recorder->recorded() + recorder->skipped() <= sequence) std::this_thread::yield();
    counted = allocations - before;
  };
  int warming = 0, warm = 0;
  for (std::uint64_t i = 0; i < 4; ++i) record(i, warming);
  for (std::uint64_t i = 4; i < 40; ++i) {
    record(i, warm);
    EXPECT_EQ(warm, 0) << "frame " << i;
  }
  EXPECT_GT(recorder->recorded(), 4U);
}

TEST_F(Recorder, TheDestructorWritesTheQueue) {
  {
    const auto recorder = open(64);
    for (std::uint64_t i = 0; i < 20; ++i) recorder->push(frame(i));
  }
  EXPECT_EQ(frames_in_file(), 20);
}

/// Limits the size of files while it exists, which simulates a full disk.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(Recorder, AFullDiskEndsTheRecordingAndFramesAreStillForwarded) {
  made.width = 160;
  made.height = 120;
  {
    const auto recorder = open(4);
    const SmallDisk disk(1'000'000);
    for (std::uint64_t i = 0; i < 60; ++i) {
      recorder->push(frame(i));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_EQ(ends.pushed, 60);
    const Status status = recorder->finish();
    EXPECT_EQ(status.code(), StatusCode::resource_exhausted);
    EXPECT_THAT(status.message(), HasSubstr(path));
    EXPECT_EQ(recorder->last_error().code(), StatusCode::resource_exhausted);
    EXPECT_EQ(recorder->faults(), 1U) << "the recording ended with the first error";
    EXPECT_EQ(recorder->recorded() + recorder->skipped(), 60U);
    // The first frames, up to the limit.
    EXPECT_GE(frames_in_file(), 4);
    EXPECT_LE(frames_in_file(), 8);
  }
}

TEST_F(Recorder, InvalidOptionsAndPathsAreRefused) {
  EXPECT_EQ(FrameRecorder::open(path, RecordingHeader(), ends, 0).status().code(), StatusCode::invalid_argument);
  EXPECT_FALSE(FrameRecorder::open(scratch.path("no/folder"), RecordingHeader(), ends).ok());
  scratch.write("text", std::string_view("no recording"));
  EXPECT_EQ(FrameRecorder::open(scratch.path("text"), RecordingHeader(), ends).status().code(),
            StatusCode::failed_precondition);
}

}  // namespace
}  // namespace lightwell
