// The panel of the window: what can be changed while the viewer runs.
#pragma once

#include <string>

#include "ar_viewer/viewer.hpp"

struct GLFWwindow;

namespace lightwell::viewer {

/// What the user asked for in this frame, beside changes of the viewer's scene.
struct PanelRequests {
  bool screenshot = false;
  bool toggle_video = false;
};

/// Owns the context of Dear ImGui for one window, whose OpenGL context must be current.
class Panel {
 public:
  explicit Panel(GLFWwindow* window);
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;
  ~Panel();

  /// Draws the panel over the picture and applies its changes to the viewer. message: the last error or file name.
  [[nodiscard]] PanelRequests draw(Viewer& viewer, const FrameReport& report, const std::string& message);
  /// Whether the keyboard belongs to a field of the panel.
  [[nodiscard]] bool wants_keyboard() const;

 private:
  void draw_light(Viewer& viewer, const FrameReport& report);
  void draw_shadow(Scene& scene);
  void draw_materials(Viewer& viewer);

  std::string error_;
};

}  // namespace lightwell::viewer
