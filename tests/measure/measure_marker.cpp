// Light from a marker in path-traced frames: prints one JSON object per line for tests/figures: figure, value (angle in
// degrees between estimated and true direction from the body's centre), frames, flagged, unanswered (numbers of frames;
// flagged and unanswered frames do not count for the value).
//   thesis.mean, .median, .PLACE, .BODY.VIEW     results published in the thesis (Straughn 2018), with `where`
//   arief2012.mean                               the result published by Arief et al. 2012, with `where`
//   COLUMN.ENCODING.setting                      the value chosen over the grid (a published method's threshold)
//   COLUMN.ENCODING.GROUP.mean, .median, .worst  over a group of frames (grid, low, air)
//   COLUMN.ENCODING.GROUP.PLACE.mean, .worst     lamp in front, front_right, right, back_right, behind
//   COLUMN.ENCODING.GROUP.BODY.VIEW.mean         white or grey, straight or turned
//   COLUMN.ENCODING.GROUP.BODY.VIEW.PLACE.mean   one case
// Columns: measure/marker_methods.hpp. Encodings: srgb, linear. Sensor, exposure: measure/traced_frames.hpp; the noise
// is the same in every run.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/descriptor.hpp>
#include <lightwell/quantile.hpp>

#include "bench/arief2012.hpp"
#include "bench/straughn2018_published.hpp"
#include "measure/marker_methods.hpp"
#include "measure/output.hpp"
#include "measure/traced_frames.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_marker: %s\n", s.message().c_str());
  std::exit(1);
}

struct Errors {
  std::vector<double> deg;
  int frames = 0, flagged = 0, unanswered = 0;

  void add(const measure::MarkerAnswer& answer, Vec3d truth) {
    ++frames;
    if (!answer.given)
      ++unanswered;
    else if (answer.flagged)
      ++flagged;
    else
      deg.push_back(angle_between(answer.direction, truth) * 180 / std::numbers::pi);
  }
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const double d : deg) sum += d;
    return sum / static_cast<double>(deg.size());
  }
  [[nodiscard]] double worst() const { return deg.empty() ? NAN : *std::max_element(deg.begin(), deg.end()); }
  [[nodiscard]] double median() const { return lightwell::median(std::vector(deg)); }
};

void print(const std::string& figure, double value, const Errors& of) {
  measure::print_figure(figure, value, {{"frames", of.frames}, {"flagged", of.flagged}, {"unanswered", of.unanswered}});
}

void print(const bench::StraughnPublished& p) {
  measure::print_line({{"figure", std::string("thesis.") + p.what},
                       {"value", p.degrees()},
                       {"percent", p.percent},
                       {"where", p.where}});
}

void print(const measure::MarkerColumn& column, const std::string& encoding,
           const std::vector<const measure::TracedFrame*>& looked_at) {
  const std::string name = column.name + "." + encoding;
  if (column.setting > 0) measure::print_figure(name + ".setting", column.setting);
  std::map<std::string, Errors> groups, places, views, cases;
  for (std::size_t k = 0; k < looked_at.size(); ++k) {
    const measure::TracedFrame& f = *looked_at[k];
    const std::string group = name + "." + f.group, view = group + "." + f.body + "." + f.view;
    for (Errors* errors : {&groups[group], &places[group + "." + f.place], &views[view], &cases[view + "." + f.place]})
      errors->add(column.answers[k], f.lamps.front().direction);
  }
  for (const auto& [figure, errors] : groups) {
    print(figure + ".mean", errors.mean(), errors);
    print(figure + ".median", errors.median(), errors);
    print(figure + ".worst", errors.worst(), errors);
  }
  for (const auto& [figure, errors] : places) {
    print(figure + ".mean", errors.mean(), errors);
    print(figure + ".worst", errors.worst(), errors);
  }
  for (const auto& [figure, errors] : views) print(figure + ".mean", errors.mean(), errors);
  for (const auto& [figure, errors] : cases) print(figure + ".mean", errors.mean(), errors);
}

}  // namespace

int main(int argc, char** argv) {
  std::string frames_folder = LIGHTWELL_MARKER_FRAMES, bodies_folder = LIGHTWELL_MARKER_BODIES;
  int noisy = 10;
  CLI::App app{"Light from a marker in path-traced frames, by the estimator and by published methods.",
               "measure_marker"};
  app.add_option("--noisy", noisy, "Noisy 8-bit frames of each image [10]")->check(CLI::PositiveNumber);
  app.add_option("--frames", frames_folder, "Folder of scenes.json and the images [tests/reference/mitsuba/marker]");
  app.add_option("--bodies", bodies_folder,
                 "Folder of dodecahedron_100mm_{white,grey}.textproto [firmware/estimate/marker/bodies]");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;

  const std::set<std::string> groups{"grid", "low", "air"};
  const auto frames = measure::load_traced_frames(frames_folder);
  if (!frames) fail(frames.status());
  const auto bodies = measure::load_traced_bodies(bodies_folder);
  if (!bodies) fail(bodies.status());

  print(bench::kStraughnMean);
  print(bench::kStraughnMedian);
  for (const auto& p : bench::kStraughnByLamp) print(p);
  for (const auto& p : bench::kStraughnByView) print(p);
  measure::print_line({{"figure", "arief2012.mean"},
                       {"value", bench::kAriefPublished_rad * 180 / std::numbers::pi},
                       {"where", "abstract: below 0.038 rad, one lamp, uniform surface"}});

  for (const bool srgb : {true, false}) {
    auto seed = measure::make_straughn_method(srgb);
    if (!seed) fail(seed.status());
    std::vector<std::unique_ptr<measure::MarkerMethod>> methods;
    methods.push_back(std::move(*seed));
    methods.push_back(measure::make_arief_method());
    methods.push_back(measure::make_estimator_method());
    std::vector<const measure::TracedFrame*> looked_at;
    measure::TracedSensor sensor;
    sensor.srgb = srgb;
    for (const measure::TracedFrame& frame : *frames) {
      if (!groups.contains(frame.group)) continue;
      const MarkerBody& body = bodies->at(frame.body);
      const auto picture = measure::TracedPicture::load(frames_folder, frame, body);
      if (!picture) fail(picture.status());
      const RigParameters rig = picture->rig_for(sensor);
      for (int k = 0; k < noisy; ++k) {
        // The name seeds the noise independently of other images.
        const measure::Shot shot =
            picture->expose(sensor, std::uint64_t{fnv1a_32(frame.name)} + static_cast<std::uint64_t>(k));
        for (const auto& method : methods)
          if (const Status s = method->process(frame, rig, body, shot); !s.ok()) fail(s);
        looked_at.push_back(&frame);
      }
    }
    for (const auto& method : methods)
      for (const measure::MarkerColumn& column : method->columns()) print(column, srgb ? "srgb" : "linear", looked_at);
  }
  return 0;
}
