// Frames into files, without a display.
#pragma once

#include <string>

#include <lightwell/result.hpp>

#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

/// What is written for each frame besides the PNG.
enum class LinearOutput { none, exr };
enum class ReportOutput { none, json };

struct HeadlessOptions {
  int frames = 1;
  std::string folder = ".";
  LinearOutput linear = LinearOutput::none;
  ReportOutput report = ReportOutput::none;
  std::string source = "light";
};

/// Writes the files of README.md, "Output of --headless". Errors of HeadlessContext, Viewer and files.
[[nodiscard]] Status run_headless(Scene scene, const HeadlessOptions& options);

}  // namespace lightwell::viewer
