// frames.csv: which pictures of a folder make which frame.
//   file,lens,exposure_s,time_s,bracket_index,bracket_size
//   a0.png,0,0.004,0.000,0,2
// The first line names the columns, in any order. file, exposure_s and time_s must be there; lens,
// bracket_index and row_readout_s are 0 and bracket_size and gain 1 where their column is not. Rows
// in a run with the same time_s (of the middle of the exposure, from any start) and exposure_s are
// one frame, a lens each; times grow from frame to frame. No quotes: a file's name holds no comma.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/frame.hpp"

namespace lightwell::replay {

struct ListedFrame {
  FrameInfo info;                  ///< sequence counts the list's frames from 0.
  std::vector<std::string> files;  ///< One a lens, in the order of the lenses.
};

/// Every frame has as many files and as large a bracket as the first. invalid_argument names `name`
/// and the line.
[[nodiscard]] Result<std::vector<ListedFrame>> parse_frame_list(std::string_view text, const std::string& name);

}  // namespace lightwell::replay
