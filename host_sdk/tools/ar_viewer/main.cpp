// ar_viewer: virtual objects in the light of a probe.
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "ar_viewer/headless.hpp"
#include "ar_viewer/scene.hpp"
#include "ar_viewer/window.hpp"

namespace {

using namespace lightwell::viewer;

constexpr const char* kAbout = R"(Virtual objects over a camera picture, in the light of a Lightwell probe.

SCENE is a JSON file: camera, background, light, real plane, objects. Its fields are those of the
README, host_sdk/tools/ar_viewer.)";

constexpr const char* kExamples = R"(Examples:
  ar_viewer scene.json                                 a window; its panel names the keys
  ar_viewer scene.json --headless --frames 1 --out pictures --linear --json

With --json a line for each frame: frame, sdk_ms (queries of the SDK), shadow_ms (the SDK's
ShadowCaster), render_ms, validity (of the light), camera_found (false: no tag in the picture).

Exit codes: 0 ok, 2 usage, 4 the scene or one of its files, or rendering is not possible.)";

int fail(const lightwell::Status& status) {
  std::cerr << "ar_viewer: " << status.message() << '\n';
  return 4;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(kAbout, "ar_viewer");
  app.footer(kExamples);
  std::string path;
  HeadlessOptions options;
  bool headless = false, linear = false, json = false;
  app.add_option("SCENE", path, "The scene file")->required();
  CLI::Option* without_window = app.add_flag("--headless", headless, "Write pictures, without a display");
  app.add_option("--frames", options.frames, "Number of frames [1]")
      ->check(CLI::Range(1, 1'000'000))
      ->needs(without_window);
  app.add_option("--out", options.folder, "Folder of pictures, screenshots and videos [.]");
  app.add_flag("--linear", linear, "Also linear pictures and the shadow, .exr")->needs(without_window);
  app.add_flag("--json", json, "Times of each frame on standard output")->needs(without_window);
  app.add_option("--source", options.source, "A light of the scene's sources by name [light]");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  options.linear = linear ? LinearOutput::exr : LinearOutput::none;
  options.report = json ? ReportOutput::json : ReportOutput::none;
  lightwell::Result<Scene> scene = read_scene(path);
  if (!scene.ok()) return fail(scene.status());
  const lightwell::Status status = headless ? run_headless(std::move(*scene), options)
                                            : run_window(std::move(*scene), {options.folder, options.source});
  return status.ok() ? 0 : fail(status);
}
