// Writes a recording of the frames that pass by, without holding them up.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <lightwell/recording.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"

namespace lightwell {

struct FrameRecorderOptions {
  /// Copies that wait for the disk. Each costs a frame's memory and bridges one frame's time.
  int queue = 8;

  [[nodiscard]] Status validate() const;
};

/// A sink between the camera and another sink. push() copies the frame, hands it on, and a thread
/// of the recorder's own writes the copy. Where the disk is too slow, frames are skipped and
/// counted. Where it is full (or writing fails otherwise) the recording ends, what was written
/// stays readable, and frames go on to the next sink. Nothing is allocated for a frame once every
/// place in the queue has held one of its size.
class FrameRecorder final : public FrameSink {
 public:
  /// Makes the file, or goes on with one of kind frames. `header.kind` is set here. `next` must
  /// outlive the recorder. Errors as RecordWriter::open(), and invalid_argument for the options.
  [[nodiscard]] static Result<std::unique_ptr<FrameRecorder>> open(const std::string& path, RecordingHeader header,
                                                                   FrameSink& next,
                                                                   const FrameRecorderOptions& options = {});

  /// Writes what waits and ends the thread. No push() may be under way.
  ~FrameRecorder() override;

  /// From the camera's thread. A copy of the frame's pictures long (about 0.1 ms a megabyte).
  void push(Frame frame) override;
  /// Of the next sink: frames that the disk is too slow for are skipped, not waited for.
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override { return next_.wait_for_space(std::move(stop)); }

  /// Writes what waits and ends the recording; frames that still come are handed on. ok, or why not
  /// all is on disk.
  [[nodiscard]] Status finish();

  // Counters, from any thread; recorded() + skipped() are all the frames that came and are no
  // longer waiting.
  [[nodiscard]] std::uint64_t recorded() const;  ///< Handed to the file.
  [[nodiscard]] std::uint64_t skipped() const;   ///< Not recorded: no room in the queue, or the recording had ended.
  [[nodiscard]] std::uint64_t faults() const;    ///< Writes that failed.
  /// The first write that failed, or ok. Names the file.
  [[nodiscard]] Status last_error() const;

 private:
  class Writer;
  FrameRecorder(FrameSink& next, std::unique_ptr<Writer> writer);
  FrameSink& next_;
  std::unique_ptr<Writer> writer_;
};

}  // namespace lightwell
