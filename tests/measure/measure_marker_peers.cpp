// Published methods beside the estimator on the random path-traced scenes (tests/reference/mitsuba/marker_scenes): the
// thesis's algorithm (seed S1) and shadows by Arief 2012, with the threshold that is best for the set `dev`. Prints one
// JSON object per line: SET.CLASS.METHOD.median, .decile (degrees, of the strongest lamp), .answered (percent).
// Only dodecahedra, which the thesis's algorithm needs. Flagged estimates count like others.
#include <algorithm>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/quantile.hpp>

#include "measure/marker_methods.hpp"
#include "measure/marker_scenes.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"
#include "tools/lens_image.hpp"

namespace {

using namespace lightwell;
using measure::MarkerScene;

measure::Shot shot_of(const MarkerScene& scene, const Image& image) {
  measure::Shot out;
  Frame& frame = out.frames.emplace_back();
  frame.info.sequence = 1;
  frame.info.exposure_s = scene.exposure_s;
  frame.add_view(view_of(image, 0));
  return out;
}

/// What the methods read of a frame. Thresholds are chosen over the group "grid".
measure::TracedFrame frame_of(const MarkerScene& scene, bool chooses_thresholds) {
  measure::TracedFrame out;
  out.name = scene.name;
  out.group = chooses_thresholds ? "grid" : "other";
  out.body = scene.body;
  out.lamps.emplace_back().direction = scene.lamps.front().direction;
  return out;
}

void print(const measure::MarkerColumn& column, const std::vector<const MarkerScene*>& scenes) {
  struct Errors {
    std::vector<double> deg;
    double pictures = 0;
  };
  std::map<std::string, Errors> groups;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const MarkerScene& scene = *scenes[k];
    const std::string set = scene.name.substr(0, scene.name.find('/'));
    const double deg =
        angle_between(column.answers[k].direction, scene.lamps.front().direction) * 180 / std::numbers::pi;
    for (const std::string& group : {set + ".all", set + "." + to_string(scene.scene_class)}) {
      groups[group].pictures += 1;
      if (column.answers[k].given) groups[group].deg.push_back(deg);
    }
  }
  for (auto& [group, errors] : groups) {
    const std::string name = group + "." + column.name;
    const auto answers = static_cast<double>(errors.deg.size());
    measure::print_figure(name + ".answered", 100 * answers / errors.pictures, {{"pictures", errors.pictures}});
    measure::print_figure(name + ".median", median(errors.deg), {{"pictures", answers}});
    measure::print_figure(name + ".decile", lower_quantile(errors.deg, 0.9), {{"pictures", answers}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string folder = LIGHTWELL_MARKER_SCENES, bodies_folder = LIGHTWELL_MARKER_BODIES;
  std::vector<std::string> sets = {"dev"};
  CLI::App app{"Published methods on path-traced pictures of random scenes.", "measure_marker_peers"};
  app.add_option("--set", sets, "dev, unseen; dev is always measured, because thresholds are chosen on it [dev]")
      ->check(CLI::IsMember({"dev", "unseen"}));
  app.add_option("--scenes", folder, "Folder of SET.jsonl and SET/*.jpg [tests/reference/mitsuba/marker_scenes]");
  app.add_option("--bodies", bodies_folder, "Folder of the marker bodies [firmware/estimate/marker/bodies]");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    if (std::ranges::find(sets, "dev") == sets.end()) sets.push_back("dev");
    std::vector<std::unique_ptr<measure::MarkerMethod>> methods;
    methods.push_back(require(measure::make_straughn_method(true)));
    methods.push_back(measure::make_arief_method());
    methods.push_back(measure::make_estimator_method());
    std::map<std::string, MarkerBody> bodies;
    std::map<std::string, std::vector<MarkerScene>> all;
    std::vector<const MarkerScene*> measured;
    for (const std::string& set : sets) all[set] = require(measure::load_marker_scenes(folder, set));
    for (const auto& [set, scenes] : all)
      for (const MarkerScene& scene : scenes) {
        if (!scene.body.starts_with("dodecahedron")) continue;
        if (!bodies.contains(scene.body))
          bodies.emplace(scene.body, require(load_marker_body(bodies_folder + "/" + scene.body + ".textproto")));
        const Image image = require(read_lens_image(folder + "/" + scene.name + ".jpg", scene.rig, 0));
        const measure::Shot shot = shot_of(scene, image);
        const measure::TracedFrame frame = frame_of(scene, set == "dev");
        for (const auto& method : methods) require(method->process(frame, scene.rig, bodies.at(scene.body), shot));
        measured.push_back(&scene);
      }
    for (const auto& method : methods)
      for (const measure::MarkerColumn& column : method->columns()) print(column, measured);
    return kDone;
  });
}
