// Records frames on their way from the camera to another sink, without delaying them.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"

namespace lightwell {

/// A sink between the camera and another sink. push() copies the frame and forwards it; a thread of the recorder writes
/// the copy. If the disk is too slow, frames are skipped and counted. If the disk is full (or writing fails otherwise)
/// the recording ends, what was written stays readable, and frames are still forwarded. No memory is allocated per
/// frame once every place in the queue has held a frame of that size.
class FrameRecorder final : public FrameSink {
 public:
  /// Creates the file, or appends to a recording of kind frames. Sets `header.kind`. `next` must outlive the recorder.
  /// Errors as RecordWriter::open(), and invalid_argument for the queue. `queue`: number of copies that can wait to be
  /// written, 1 to 1024. Each costs the memory of a frame and lets the disk stall for one frame interval.
  [[nodiscard]] static Result<std::unique_ptr<FrameRecorder>> open(const std::string& path, RecordingHeader header,
                                                                   FrameSink& next, int queue = 8);

  /// Writes the queue and ends the thread. No push() may be in progress.
  ~FrameRecorder() override { (void)finish(); }

  /// Called on the camera's thread. Takes as long as copying the frame's pictures (about 0.1 ms per megabyte).
  void push(Frame frame) override;
  /// Forwarded to the next sink: the recorder skips frames rather than wait for the disk.
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override { return next_.wait_for_space(std::move(stop)); }

  /// Writes the queue and ends the recording; later frames are only forwarded. The first write error, or ok.
  [[nodiscard]] Status finish();

  // Counters, thread-safe; recorded() + skipped() is the number of frames pushed less those in the queue.
  [[nodiscard]] std::uint64_t recorded() const { return recorded_; }  ///< Written to the file.
  /// Not recorded: the queue was full, or the recording had ended.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }
  [[nodiscard]] std::uint64_t faults() const { return faults_; }  ///< Writes that failed.
  /// Error of the first write that failed, with the file's path; or ok.
  [[nodiscard]] Status last_error() const;

 private:
  /// A frame in memory of its own.
  struct Copy {
    std::int64_t arrival_ns = 0;
    FrameRecord record;
    std::array<std::vector<std::byte>, kMaxLenses> pictures;
  };
  FrameRecorder(std::string path, RecordWriter file, FrameSink& next, int queue);
  [[nodiscard]] Copy* take_free();
  [[nodiscard]] Copy* next_waiting();
  void run();
  void note(const Status& written);

  const std::string path_;
  RecordWriter file_;
  FrameSink& next_;
  std::vector<Copy> copies_;
  mutable std::mutex mutex_;  ///< Guards the four members below.
  std::vector<Copy*> free_, waiting_;
  bool ending_ = false;
  Status error_;
  std::condition_variable changed_;
  std::atomic<std::uint64_t> recorded_{0}, skipped_{0}, faults_{0};
  std::thread thread_;
};

}  // namespace lightwell
