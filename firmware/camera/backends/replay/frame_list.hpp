// Parses frames.csv, which lists the pictures of a folder and the frames they belong to.
//   file,lens,exposure_s,time_s,bracket_index,bracket_size
//   a0.png,0,0.004,0.000,0,2
// The first line names the columns, in any order. file, exposure_s and time_s are required; lens, bracket_index and
// row_readout_s default to 0, bracket_size and gain to 1. Consecutive rows with the same time_s (mid-exposure, any
// origin) and exposure_s are one frame, one row per lens; times increase from frame to frame. Quotes are not supported:
// file names cannot contain commas.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

#include "imaging/frame.hpp"

namespace lightwell::replay {

struct ListedFrame {
  FrameInfo info;                  ///< sequence counts the list's frames from 0.
  std::vector<std::string> files;  ///< One per lens, in the order of the lenses.
};

/// All frames have the same number of files and the same bracket size. invalid_argument names `name` and the line.
[[nodiscard]] Result<std::vector<ListedFrame>> parse_frame_list(std::string_view text, const std::string& name);
/// Reads and parses `folder`/frames.csv. not_found if there is none.
[[nodiscard]] Result<std::vector<ListedFrame>> load_frame_list(const std::string& folder);

}  // namespace lightwell::replay
