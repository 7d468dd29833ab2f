// Sources of replayed frames: a recording, or a folder of pictures that its frames.csv lists.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/frame.hpp"

namespace lightwell::replay {

struct ListedFrame {
  FrameInfo info;                  ///< sequence counts the list's frames from 0.
  std::vector<std::string> files;  ///< One per lens, in the order of the lenses.
};

/// Parses frames.csv.
///   file,lens,exposure_s,time_s,bracket_index,bracket_size
///   a0.png,0,0.004,0.000,0,2
/// The first line names the columns, in any order. file, exposure_s and time_s are required; lens, bracket_index and
/// row_readout_s default to 0, bracket_size and gain to 1. Consecutive rows with the same time_s (mid-exposure, any
/// origin) and exposure_s are one frame, one row per lens; times increase from frame to frame. File names cannot
/// contain commas.
///
/// All frames have the same number of files and the same bracket size. invalid_argument names `name` and the line.
[[nodiscard]] Result<std::vector<ListedFrame>> parse_frame_list(std::string_view text, const std::string& name);
/// Reads and parses `folder`/frames.csv. not_found if there is none.
[[nodiscard]] Result<std::vector<ListedFrame>> load_frame_list(const std::string& folder);

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
