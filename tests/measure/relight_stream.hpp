// Time and memory of the direct part of relit performances, from disk.
#pragma once

#include <string>

namespace lightwell::measure {

/// Writes 12 frames of 29 photographs of 800 x 600 pixels into `folder` (500 MB, removed at the end; empty: the folder
/// for temporary files), relights them under four patterns and distant light, and prints a line for a file in the page
/// cache and one for a file that is not.
void measure_relight_stream(const std::string& folder);

}  // namespace lightwell::measure
