#include "ar_viewer/window.hpp"

#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include <epoxy/gl.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include "ar_viewer/frame_recorder.hpp"
#include "ar_viewer/panel.hpp"
#include "ar_viewer/viewer.hpp"

namespace lightwell::viewer {
namespace {

struct TerminateGlfw {
  ~TerminateGlfw() { glfwTerminate(); }
};
struct DestroyWindow {
  void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};
using WindowPointer = std::unique_ptr<GLFWwindow, DestroyWindow>;

/// Keys since the last frame, each once.
class Keys {
 public:
  explicit Keys(GLFWwindow* window) {
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, [](GLFWwindow* from, int key, int, int action, int) {
      if (action == GLFW_PRESS) static_cast<Keys*>(glfwGetWindowUserPointer(from))->pressed_.push_back(key);
    });
  }
  [[nodiscard]] std::vector<int> take() { return std::exchange(pressed_, {}); }

 private:
  std::vector<int> pressed_;
};

/// Shows the finished picture in the window.
class Display {
 public:
  [[nodiscard]] static Result<Display> make() {
    Result<ShaderProgram> program = ShaderProgram::make("screen_vertex.glsl", "display_fragment.glsl");
    if (!program.ok()) return program.status();
    return Display(std::move(*program));
  }
  void show(GLFWwindow* window, GLuint picture) const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window, &width, &height);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width, height);
    glDisable(GL_DEPTH_TEST);
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::background));
    glBindTexture(GL_TEXTURE_2D, picture);
    program_.use();
    program_.set("window_size", glm::vec2(width, height));
    glBindVertexArray(array_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

 private:
  explicit Display(ShaderProgram program) : program_(std::move(program)) {}
  ShaderProgram program_;
  GlVertexArray array_;
};

/// The next source by name.
Status next_source(Viewer& viewer) {
  const auto& lights = viewer.scene().lights;
  auto next = std::next(lights.find(viewer.source()));
  return viewer.set_source(next == lights.end() ? lights.begin()->first : next->first);
}

struct Session {
  bool panel_shown = true;
  std::string message;

  void report_file(const Result<std::string>& file) { message = file.ok() ? *file : file.status().message(); }
};

/// Applies a key; screenshot and video go into `requests`.
void apply_key(int key, GLFWwindow* window, Viewer& viewer, Session& session, PanelRequests& requests) {
  Scene& scene = viewer.scene();
  if (key >= GLFW_KEY_1 && key < GLFW_KEY_1 + static_cast<int>(kShadings.size()))
    scene.shading = kShadings[static_cast<std::size_t>(key - GLFW_KEY_1)];
  if (key == GLFW_KEY_S)
    scene.side_by_side = scene.side_by_side ? std::nullopt : std::optional(Shading::main_light_and_sh9);
  if (key == GLFW_KEY_N) {
    const Status status = next_source(viewer);
    session.message = status.ok() ? "source: " + viewer.source() : status.message();
  }
  if (key == GLFW_KEY_P) requests.screenshot = true;
  if (key == GLFW_KEY_V) requests.toggle_video = true;
  if (key == GLFW_KEY_F1) session.panel_shown = !session.panel_shown;
  if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(window, GLFW_TRUE);
}

Status run_loop(GLFWwindow* window, Viewer& viewer, FrameRecorder& recorder) {
  Result<Display> display = Display::make();
  if (!display.ok()) return display.status();
  Keys keys(window);
  Panel panel(window);  // After Keys, whose callback it calls.
  Session session;
  Picture picture;
  while (glfwWindowShouldClose(window) == GLFW_FALSE) {
    glfwPollEvents();
    const Result<FrameReport> report = viewer.draw_next();
    if (!report.ok()) return report.status();
    display->show(window, viewer.renderer().target().texture());
    PanelRequests requests;
    if (session.panel_shown) requests = panel.draw(viewer, *report, session.message);
    for (const int key : keys.take())
      if (!panel.wants_keyboard()) apply_key(key, window, viewer, session, requests);
    const FrameTarget& target = viewer.renderer().target();
    if (requests.toggle_video) session.report_file(recorder.toggle_video(target.width(), target.height()));
    if (requests.screenshot || recorder.records_video()) target.read(picture);
    if (requests.screenshot) session.report_file(recorder.write_screenshot(picture));
    if (recorder.records_video()) recorder.add(picture);
    glfwSwapBuffers(window);
  }
  return {};
}

}  // namespace

Status run_window(Scene scene, const WindowOptions& options) {
  const auto failed = [](const std::string& what) {
    return Status(StatusCode::failed_precondition, what + "; --headless draws without a display");
  };
  if (glfwInit() != GLFW_TRUE) return failed("there is no display");
  const TerminateGlfw terminate;
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  const WindowPointer window(glfwCreateWindow(scene.camera.width, scene.camera.height, "ar_viewer", nullptr, nullptr));
  if (!window) return failed("there is no window with OpenGL 3.3");
  glfwMakeContextCurrent(window.get());
  glfwSwapInterval(1);
  Result<Viewer> viewer = Viewer::make(std::move(scene), options.source);
  if (!viewer.ok()) return viewer.status();
  FrameRecorder recorder(options.folder);
  return run_loop(window.get(), *viewer, recorder);
}

}  // namespace lightwell::viewer
