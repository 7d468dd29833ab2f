// Light from a marker in path-traced frames: prints one JSON object per line for tests/figures: figure, value (angle in
// degrees between estimated and true direction from the body's centre), frames, flagged, unanswered (numbers of frames;
// flagged and unanswered frames do not count for the value).
//   thesis.mean, .median, .PLACE, .BODY.VIEW     results published in the thesis (Straughn 2018), with `where`
//   COLUMN.ENCODING.setting                      the value chosen over all frames (the thesis's threshold)
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
#include <cstring>
#include <map>
#include <numbers>
#include <set>
#include <string>

#include "bench/straughn2018_published.hpp"
#include "measure/marker_methods.hpp"
#include "measure/traced_frames.hpp"

namespace {

using namespace lightwell;

constexpr const char* kUsage =
    "usage: measure_marker [--noisy N] [--frames FOLDER] [--bodies FOLDER]\n"
    "Light from a marker in path-traced frames, one JSON object per line: the thesis (Straughn 2018), and what it "
    "published.\n"
    "  --noisy N         noisy 8-bit frames of each image [10]\n"
    "  --frames FOLDER   folder of scenes.json and the images [tests/reference/mitsuba/marker]\n"
    "  --bodies FOLDER   folder of dodecahedron_100mm_{white,grey}.textproto [firmware/estimate/marker/bodies]\n"
    "Exit status: 0 measured, 1 failed, 2 wrong usage.\n";

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
  [[nodiscard]] double median() const {
    if (deg.empty()) return NAN;
    std::vector<double> sorted = deg;
    std::sort(sorted.begin(), sorted.end());
    return 0.5 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
  }
};

/// Number of an image's first capture, which seeds its noise independently of other images: FNV-1a, 32 bits.
std::uint64_t first_capture(const std::string& name) {
  std::uint32_t hash = 2166136261U;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash;
}

void print(const std::string& figure, double value, const Errors& of) {
  std::printf("{\"figure\": \"%s\", \"value\": ", figure.c_str());
  if (std::isfinite(value))
    std::printf("%.5g", value);
  else
    std::printf("null");
  std::printf(", \"frames\": %d, \"flagged\": %d, \"unanswered\": %d}\n", of.frames, of.flagged, of.unanswered);
}

void print(const bench::StraughnPublished& p) {
  std::printf("{\"figure\": \"thesis.%s\", \"value\": %.5g, \"percent\": %.5g, \"where\": \"%s\"}\n", p.what,
              p.degrees(), p.percent, p.where);
}

void print(const measure::MarkerColumn& column, const std::string& encoding,
           const std::vector<const measure::TracedFrame*>& looked_at) {
  const std::string name = column.name + "." + encoding;
  if (column.setting > 0) std::printf("{\"figure\": \"%s.setting\", \"value\": %.5g}\n", name.c_str(), column.setting);
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
  for (int i = 1; i < argc; i += 2) {
    const bool has_value = i + 1 < argc;
    if (std::strcmp(argv[i], "--help") == 0) return std::printf("%s", kUsage), 0;
    if (has_value && std::strcmp(argv[i], "--noisy") == 0)
      noisy = std::atoi(argv[i + 1]);
    else if (has_value && std::strcmp(argv[i], "--frames") == 0)
      frames_folder = argv[i + 1];
    else if (has_value && std::strcmp(argv[i], "--bodies") == 0)
      bodies_folder = argv[i + 1];
    else
      return std::fprintf(stderr, "%s", kUsage), 2;
  }
  if (noisy < 1) return std::fprintf(stderr, "%s", kUsage), 2;

  const std::set<std::string> groups{"grid", "low", "air"};
  const auto frames = measure::load_traced_frames(frames_folder);
  if (!frames) fail(frames.status());
  const auto bodies = measure::load_traced_bodies(bodies_folder);
  if (!bodies) fail(bodies.status());

  print(bench::kStraughnMean);
  print(bench::kStraughnMedian);
  for (const auto& p : bench::kStraughnByLamp) print(p);
  for (const auto& p : bench::kStraughnByView) print(p);

  for (const bool srgb : {true, false}) {
    auto seed = measure::make_straughn_method(srgb);
    if (!seed) fail(seed.status());
    std::vector<std::unique_ptr<measure::MarkerMethod>> methods;
    methods.push_back(std::move(*seed));
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
        const measure::Shot shot = picture->expose(sensor, first_capture(frame.name) + static_cast<std::uint64_t>(k));
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
