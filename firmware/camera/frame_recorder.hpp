// Records frames on their way from the camera to another sink, without delaying them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <lightwell/recording.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"

namespace lightwell {

struct FrameRecorderOptions {
  /// Capacity of the queue of copies that wait to be written. Each costs the memory of a frame and lets the disk stall
  /// for one frame interval.
  int queue = 8;

  [[nodiscard]] Status validate() const;
};

/// A sink between the camera and another sink. push() copies the frame and forwards it; a thread of the recorder writes
/// the copy. If the disk is too slow, frames are skipped and counted. If the disk is full (or writing fails otherwise)
/// the recording ends, what was written stays readable, and frames are still forwarded. No memory is allocated per
/// frame once every place in the queue has held a frame of that size.
class FrameRecorder final : public FrameSink {
 public:
  /// Creates the file, or appends to a recording of kind frames. Sets `header.kind`. `next` must outlive the recorder.
  /// Errors as RecordWriter::open(), and invalid_argument for the options.
  [[nodiscard]] static Result<std::unique_ptr<FrameRecorder>> open(const std::string& path, RecordingHeader header,
                                                                   FrameSink& next,
                                                                   const FrameRecorderOptions& options = {});

  /// Writes the queue and ends the thread. No push() may be in progress.
  ~FrameRecorder() override;

  /// Called on the camera's thread. Takes as long as copying the frame's pictures (about 0.1 ms per megabyte).
  void push(Frame frame) override;
  /// Forwarded to the next sink: the recorder skips frames rather than wait for the disk.
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override { return next_.wait_for_space(std::move(stop)); }

  /// Writes the queue and ends the recording; later frames are only forwarded. The first write error, or ok.
  [[nodiscard]] Status finish();

  // Counters, thread-safe; recorded() + skipped() is the number of frames pushed less those in the queue.
  [[nodiscard]] std::uint64_t recorded() const;  ///< Written to the file.
  [[nodiscard]] std::uint64_t skipped() const;   ///< Not recorded: the queue was full, or the recording had ended.
  [[nodiscard]] std::uint64_t faults() const;    ///< Writes that failed.
  /// Error of the first write that failed, with the file's path; or ok.
  [[nodiscard]] Status last_error() const;

 private:
  class Writer;
  FrameRecorder(FrameSink& next, std::unique_ptr<Writer> writer);
  FrameSink& next_;
  std::unique_ptr<Writer> writer_;
};

}  // namespace lightwell
