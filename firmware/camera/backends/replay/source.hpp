// Sources of replayed frames: a recording or a folder.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/frame.hpp"

namespace lightwell::replay {

/// One frame; its memory is reused for the next.
struct StoredFrame {
  FrameInfo info;  ///< As recorded; `delivered` is not set.
  std::array<View, kMaxLenses> views{};
  std::size_t view_count = 0;
  std::array<std::vector<std::byte>, kMaxLenses> pictures;  ///< Memory of the views.
};

/// Not thread-safe.
class Source {
 public:
  virtual ~Source() = default;

  /// Properties of the frames. frame_rate is the recorded one, 0 for a single frame.
  [[nodiscard]] const CameraInfo& info() const { return info_; }
  /// Reads the next frame that is as info() declares and valid for an estimator; false at the end.
  [[nodiscard]] bool next(StoredFrame& out);
  /// Back to the first frame.
  virtual void rewind() = 0;

 protected:
  /// Reads the next readable frame; false at the end.
  [[nodiscard]] virtual bool read(StoredFrame& out) = 0;
  CameraInfo info_;
};

/// A folder or a recording, depending on `path`. not_found, data_loss, invalid_argument; the message states the remedy.
[[nodiscard]] Result<std::unique_ptr<Source>> open_source(const std::string& path);

}  // namespace lightwell::replay
