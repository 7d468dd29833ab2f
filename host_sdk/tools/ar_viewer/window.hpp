// The interactive viewer.
#pragma once

#include <string>

#include <lightwell/result.hpp>

#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

struct WindowOptions {
  std::string folder = ".";  ///< Of screenshots and videos.
  std::string source = "light";
};

/// Shows the scene in a window until it is closed. failed_precondition if there is no display or no OpenGL 3.3; errors
/// of Viewer.
[[nodiscard]] Status run_window(Scene scene, const WindowOptions& options);

}  // namespace lightwell::viewer
