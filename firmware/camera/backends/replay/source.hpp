// Where replayed frames are read from: a recording or a folder.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "camera/frame.hpp"

namespace lightwell::replay {

/// One frame in memory that is used again for the next.
struct StoredFrame {
  FrameInfo info;  ///< As recorded; `delivered` is not set.
  std::array<View, kMaxLenses> views{};
  std::size_t view_count = 0;
  std::array<std::vector<std::byte>, kMaxLenses> pictures;  ///< What the views look at.
};

/// Used by one thread at a time.
class Source {
 public:
  virtual ~Source() = default;

  /// What the frames are like. frame_rate is that of the original, 0 where one frame is all there
  /// is.
  [[nodiscard]] virtual const CameraInfo& info() const = 0;
  /// The next frame that can be shown, into `out`; false at the end.
  [[nodiscard]] virtual bool next(StoredFrame& out) = 0;
  /// Back to the first frame.
  virtual void rewind() = 0;
};

/// By what `path` is. not_found, data_loss, invalid_argument; the message says what to do.
[[nodiscard]] Result<std::unique_ptr<Source>> open_source(const std::string& path);
[[nodiscard]] Result<std::unique_ptr<Source>> open_recording(const std::string& path);
[[nodiscard]] Result<std::unique_ptr<Source>> open_folder(const std::string& path);

/// Whether a frame is what `info` declares and what an estimator can read without looking again:
/// sizes that fit the format, rows that are aligned, a positive exposure and gain.
[[nodiscard]] bool is_playable(const StoredFrame& frame, const CameraInfo& info);

}  // namespace lightwell::replay
