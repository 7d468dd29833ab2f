// lightwell-eval: measures time, bytes and accuracy of the estimator's settings.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "sim/panorama.hpp"
#include "tools/command_line.hpp"
#include "tools/lightwell_eval/table.hpp"

namespace {

namespace fs = std::filesystem;
using namespace lightwell;
using namespace lightwell::eval;

constexpr std::array kEight = {"city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset"};
constexpr std::string_view kMore = "pmndrs_";

/// Paths of the panoramas for "eight", "all", or names (city, pmndrs_lobby) and files with commas. Throws InputError.
std::vector<std::string> scene_files(const std::string& choice) {
  std::vector<std::string> names, out, more;
  if (choice == "eight" || choice == "all") {
    names.assign(kEight.begin(), kEight.end());
  } else {
    for (const std::string_view name : comma_separated(choice))
      if (!name.empty()) names.emplace_back(name);
  }
  if (names.empty()) refuse("--scenes is empty: give all, eight, or names like city,night");
  const auto folder = [] { return fs::path(require(sim::scene_path(kEight.front()))).parent_path(); };
  for (const std::string& name : names) {
    const bool added = name.starts_with(kMore) && !name.ends_with(".exr");
    out.push_back(added ? (folder() / (name + ".exr")).string() : require(sim::scene_path(name)));
    if (added && !fs::exists(out.back()))
      throw InputError({StatusCode::not_found,
                        out.back() + " does not exist: run cmake/fetch_panoramas --all, which lists the names"});
  }
  if (choice != "all") return out;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(folder(), error))
    if (file.path().filename().string().starts_with(kMore) && file.path().extension() == ".exr")
      more.push_back(file.path().string());
  if (more.empty())
    throw InputError({StatusCode::not_found, "there are no " + std::string(kMore) + "*.exr in " + folder().string() +
                                                 ": run cmake/fetch_panoramas --all"});
  std::ranges::sort(more);
  out.insert(out.end(), more.begin(), more.end());
  return out;
}

/// Progress on stderr: one line that is overwritten on a terminal, otherwise a line per scene.
class Progress {
 public:
  explicit Progress(std::size_t steps) : steps_(steps) {}
  void step(const std::string& scene, const std::string& what) {
    ++done_;
    if (terminal_)
      std::fprintf(stderr, "\r\033[K%3zu %%  %s: %s", 100 * done_ / steps_, scene.c_str(), what.c_str());
    else if (scene != scene_)
      std::fprintf(stderr, "%3zu %%  %s\n", 100 * (done_ - 1) / steps_, scene.c_str());
    scene_ = scene;
  }
  ~Progress() {
    if (terminal_) std::fprintf(stderr, "\r\033[K");
  }

 private:
  std::size_t steps_, done_ = 0;
  std::string scene_;
  bool terminal_ = isatty(STDERR_FILENO) == 1;
};

std::vector<Row> measure(const std::vector<std::string>& paths, bool quick, Run& run) {
  std::vector<Row> rows;
  for (Case& c : all_cases()) rows.emplace_back().setup = std::move(c);
  Bench bench(quick ? 2 : 5);
  Progress progress(paths.size() * rows.size());
  for (const std::string& path : paths) {
    sim::Panorama panorama = require(sim::load_panorama(path));
    const std::string& name = run.scenes.emplace_back(fs::path(path).stem().string());
    const GroundTruth truth(panorama);
    const BallPictures balls = ball_pictures(truth);
    const sim::Scene scene(std::move(panorama));
    std::map<int, CameraRenderer> cameras;  // By width.
    for (Row& row : rows) {
      const Case& c = row.setup;
      progress.step(name, c.label);
      auto camera = cameras.find(c.width);
      if (camera == cameras.end()) camera = cameras.emplace(c.width, CameraRenderer(scene, c.width, c.height)).first;
      row.scenes.push_back(bench.measure(c, truth, balls, camera->second));
    }
  }
  for (Row& row : rows) summarise(row, bench.memcpy_seconds().at(row.scenes.front().picture_bytes));
  const std::size_t bytes = rows.front().scenes.front().picture_bytes;
  run.memcpy_gb_per_s = static_cast<double>(bytes) / bench.memcpy_seconds().at(bytes) * 1e-9;
  mark_front(rows);
  return rows;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app{"Measures what the estimator's settings cost and what they give.", "lightwell-eval"};
  app.footer(
      "Examples:\n"
      "  lightwell-eval --pareto                       the eight panoramas of cmake/fetch_panoramas; about four "
      "minutes\n"
      "  lightwell-eval --pareto --quick               three of them, two passes; a minute\n"
      "  lightwell-eval --pareto --scenes all          with the eighteen of cmake/fetch_panoramas --all\n"
      "  lightwell-eval --pareto --scenes city,my.exr  by name, or a file (OpenEXR or Radiance, twice as wide as "
      "high)\n"
      "  lightwell-eval --pareto --marker FILE         also with the marker estimator; FILE is the output of\n"
      "                                                tests/measure/measure_marker_trade\n"
      "  lightwell-eval --marker FILE                  only the marker's table; nothing is measured or drawn\n"
      "The table goes to stdout, progress to stderr, all figures to OUT/pareto.json. To draw the chart:\n"
      "  lightwell_plot.py OUT/pareto.json --output OUT/pareto.png --output OUT/pareto.svg\n"
      "For meaningful times, use an idle machine and the preset bench.\n"
      "Exit status: 0 measured, 1 an input or output failed, 2 wrong usage.");
  bool pareto = false, json = false, quick = false;
  std::string scenes, marker_file, out = "out";
  app.add_flag("--pareto", pareto,
               "Sweep blocks, cameras, bands, lights, epsilon, maps, exposures and the named settings");
  app.add_option("--scenes", scenes,
                 "all, eight, or names and files with commas between [eight; --quick: city,interior,night]");
  app.add_option("--out", out, "Folder for pareto.json; created if it does not exist [out]");
  app.add_option("--marker", marker_file,
                 "Output of measure_marker_trade, a JSON object per line: adds a panel and a table for the marker");
  app.add_flag("--json", json, "JSON with every scene's figures, or the marker's rows, on stdout instead of the table");
  app.add_flag("--quick", quick, "Fewer scenes and passes, for a first impression");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  if (!pareto && marker_file.empty()) return wrong_usage(app, "nothing to do; give --pareto or --marker");
  std::vector<MarkerRow> marker;
  if (!marker_file.empty()) marker = require(read_marker_rows(marker_file));
  mark_front(marker);
  if (!pareto) {
    std::cout << (json ? json_text(json_of(marker)) + "\n" : marker_table_of(marker)) << std::flush;
    return kDone;
  }
  const std::vector<std::string> paths = scene_files(!scenes.empty() ? scenes
                                                     : quick         ? "city,interior,night"
                                                                     : "eight");
  std::error_code error;
  fs::create_directories(out, error);  // Before the measurement, which takes minutes.
  if (error)
    throw InputError(
        {StatusCode::not_found, "cannot create the folder " + out + ": " + error.message() + "; see --out"});

  Run run;
  run.quick = quick;
  const std::vector<Row> rows = measure(paths, quick, run);
  const std::string figures = json_text(json_of(rows, run, marker)) + "\n";
  if (json)
    std::cout << figures;
  else
    std::cout << table_of(rows, run) << (marker.empty() ? "" : "\n") << marker_table_of(marker);
  std::cout << std::flush;
  require(write_output(out + "/pareto.json", figures));
  std::cerr << "lightwell-eval: wrote " << out << "/pareto.json; lightwell_plot.py draws it\n";
  return kDone;
} catch (const lightwell::InputError& error) {
  std::cerr << "lightwell-eval: " << error.what() << "\n";
  return error.code == lightwell::StatusCode::invalid_argument ? lightwell::kUsage : lightwell::kBadInput;
}
