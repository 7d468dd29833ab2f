#include "ar_viewer/headless.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <utility>

#include <nlohmann/json.hpp>

#include "ar_viewer/headless_context.hpp"
#include "ar_viewer/viewer.hpp"

namespace lightwell::viewer {
namespace {

std::string numbered(const std::string& folder, const char* name, int frame, const char* ending) {
  std::array<char, 64> file{};
  (void)std::snprintf(file.data(), file.size(), "%s_%04d.%s", name, frame, ending);
  return (std::filesystem::path(folder) / file.data()).string();
}

Status write_frame(Viewer& viewer, const HeadlessOptions& options, int frame, Picture& picture) {
  viewer.renderer().target().read(picture);
  if (Status status = write_png(numbered(options.folder, "frame", frame, "png"), picture); !status.ok()) return status;
  if (options.linear == LinearOutput::none) return {};
  if (Status status = write_exr(numbered(options.folder, "frame", frame, "exr"), picture); !status.ok()) return status;
  if (Status status = viewer.draw_shadow(); !status.ok()) return status;
  viewer.renderer().target().read(picture);
  return write_exr(numbered(options.folder, "shadow", frame, "exr"), picture);
}

Status make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return {StatusCode::failed_precondition, folder + ": " + error.message() + "; name another with --out"};
  return {};
}

}  // namespace

Status run_headless(Scene scene, const HeadlessOptions& options) {
  const Result<HeadlessContext> context = HeadlessContext::make();
  if (!context.ok()) return context.status();
  Result<Viewer> viewer = Viewer::make(std::move(scene), options.source);
  if (!viewer.ok()) return viewer.status();
  Picture picture;
  for (int frame = 0; frame < options.frames; ++frame) {
    const Result<FrameReport> report = viewer->draw_next();
    if (!report.ok()) return report.status();
    // With the first picture, so that a scene that cannot be drawn leaves nothing.
    if (frame == 0)
      if (Status status = make_folder(options.folder); !status.ok()) return status;
    if (Status status = write_frame(*viewer, options, frame, picture); !status.ok()) return status;
    if (options.report == ReportOutput::none) continue;
    const nlohmann::ordered_json line = {{"frame", frame},
                                         {"renderer", context->renderer()},
                                         {"sdk_ms", report->sdk_ms},
                                         {"shadow_ms", report->shadow_ms},
                                         {"render_ms", report->render_ms},
                                         {"validity", std::string(to_string(report->validity))},
                                         {"camera_found", report->camera_found}};
    std::cout << line.dump() << '\n';
  }
  return {};
}

}  // namespace lightwell::viewer
