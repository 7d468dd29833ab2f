// lightwell-eval: measures time, bytes and accuracy of the estimator's settings.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include <lightwell/files.hpp>

#include "sim/panorama.hpp"
#include "tools/command_line.hpp"
#include "tools/json_text.hpp"
#include "tools/lightwell_eval/table.hpp"

namespace {

using namespace lightwell;
using namespace lightwell::eval;

int fail(const Status& s) {
  std::cerr << "lightwell-eval: " << s.message() << "\n";
  return s.code() == StatusCode::invalid_argument ? kUsage : kBadInput;
}

constexpr std::array kEight = {"city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset"};
constexpr std::string_view kMore = "pmndrs_";

/// The folder of the eight panoramas.
Result<std::filesystem::path> folder() {
  const Result<std::string> one = sim::scene_path(kEight.front());
  if (!one) return one.status();
  return std::filesystem::path(*one).parent_path();
}

/// Paths of the panoramas for "eight", "all", or a comma-separated list of names (city, pmndrs_lobby) and files.
/// not_found and invalid_argument; the message has the remedy.
Result<std::vector<std::string>> scene_files(const std::string& choice) {
  std::vector<std::string> names, out;
  if (choice == "eight" || choice == "all") {
    names.assign(kEight.begin(), kEight.end());
  } else {
    std::stringstream list(choice);
    for (std::string name; std::getline(list, name, ',');)
      if (!name.empty()) names.push_back(name);
  }
  if (names.empty())
    return Status(StatusCode::invalid_argument, "--scenes is empty: give all, eight, or names like city,night");
  for (const std::string& name : names) {
    const bool more = name.starts_with(kMore) && !name.ends_with(".exr");
    Result<std::string> path = std::string();
    if (more) {
      const auto in = folder();
      if (!in) return in.status();
      path = (*in / (name + ".exr")).string();
      if (!std::filesystem::exists(*path))
        return Status(StatusCode::not_found,
                      *path + " does not exist: run cmake/fetch_panoramas --all, which lists the names");
    } else {
      path = sim::scene_path(name);
      if (!path) return path.status();
    }
    out.push_back(*path);
  }
  if (choice != "all") return out;
  const auto in = folder();
  if (!in) return in.status();
  std::vector<std::string> more;
  std::error_code error;
  for (const auto& file : std::filesystem::directory_iterator(*in, error))
    if (file.path().filename().string().starts_with(kMore) && file.path().extension() == ".exr")
      more.push_back(file.path().string());
  if (more.empty())
    return Status(StatusCode::not_found, "there are no " + std::string(kMore) + "*.exr in " + in->string() +
                                             ": run cmake/fetch_panoramas --all");
  std::sort(more.begin(), more.end());
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

Result<std::vector<Row>> measure(const std::vector<std::string>& paths, bool quick, Run& run) {
  std::vector<Row> rows;
  for (Case& c : all_cases()) rows.emplace_back().setup = std::move(c);
  Bench bench(quick ? 2 : 5);
  Progress progress(paths.size() * rows.size());
  for (const std::string& path : paths) {
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    if (!panorama) return panorama.status();
    const std::string name = std::filesystem::path(path).stem().string();
    run.scenes.push_back(name);
    const GroundTruth truth(*panorama);
    const BallPictures balls = ball_pictures(truth);
    const sim::Scene scene(std::move(*panorama));
    std::map<int, CameraRenderer> cameras;  // By width.
    for (Row& row : rows) {
      progress.step(name, row.setup.label);
      auto camera = cameras.find(row.setup.width);
      if (camera == cameras.end()) {
        Result<CameraRenderer> made = CameraRenderer::make(scene, row.setup.width, row.setup.height);
        if (!made) return made.status();
        camera = cameras.emplace(row.setup.width, std::move(*made)).first;
      }
      Result<Outcome> outcome = bench.measure(row.setup, truth, balls, camera->second);
      if (!outcome) return outcome.status();
      row.scenes.push_back(std::move(*outcome));
    }
  }
  for (Row& row : rows) {
    const auto bytes = static_cast<std::size_t>(row.scenes.front().picture_bytes);
    summarise(row, bench.memcpy_seconds().at(bytes));
  }
  const auto bytes = static_cast<std::size_t>(rows.front().scenes.front().picture_bytes);
  run.memcpy_gb_per_s = static_cast<double>(bytes) / bench.memcpy_seconds().at(bytes) * 1e-9;
  mark_front(rows);
  return rows;
}

}  // namespace

int main(int argc, char** argv) {
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
  Result<std::vector<MarkerRow>> marker = std::vector<MarkerRow>();
  if (!marker_file.empty()) marker = read_marker_rows(marker_file);
  if (!marker) return fail(marker.status());
  mark_front(*marker);
  if (!pareto) {
    std::cout << (json ? json_text(json_of(*marker)) + "\n" : marker_table_of(*marker)) << std::flush;
    return kDone;
  }
  const Result<std::vector<std::string>> paths = scene_files(!scenes.empty() ? scenes
                                                             : quick         ? "city,interior,night"
                                                                             : "eight");
  if (!paths) return fail(paths.status());
  std::error_code error;
  std::filesystem::create_directories(out, error);  // Before the measurement, which takes minutes.
  if (error)
    return fail({StatusCode::not_found, "cannot create the folder " + out + ": " + error.message() + "; see --out"});

  Run run;
  run.quick = quick;
  const Result<std::vector<Row>> rows = measure(*paths, quick, run);
  if (!rows) return fail(rows.status());
  const std::string figures = json_text(json_of(*rows, run, *marker)) + "\n";
  if (json)
    std::cout << figures;
  else
    std::cout << table_of(*rows, run) << (marker->empty() ? "" : "\n") << marker_table_of(*marker);
  std::cout << std::flush;
  if (Status s = write_atomically(out + "/pareto.json", figures, FileMode::umask); !s.ok()) return fail(s);
  std::cerr << "lightwell-eval: wrote " << out << "/pareto.json; lightwell_plot.py draws it\n";
  return kDone;
}
