// Cost and benefit of the marker estimator's options: one JSON object per line for every case, for tests/figures and
// lightwell-eval --marker:
//   what, knob          the case, and the option that it varies: setting (the default), decimation (of the image while
//                       the body is tracked), search (decimation of the full search), faces (maximum that is sampled),
//                       order (maximum number of lights; without the table)
//   width, height       of the images
//   ms, ms_first        milliseconds for a frame while tracking, the best of some runs, and for the first frame, with a
//                       full search for body and lights: medians over images; CPU time of the thread
//   memcpy_ratio        ms relative to memcpy of a frame
//   rms, worst_rms      relative RMS error of irradiance over normals within 60 degrees of the camera: median and
//                       maximum
//   direction_deg       angle between the strongest true lamp and the nearest of the strongest estimated lights, as
//                       many as there are lamps: median
//   worst_direction_deg the same: maximum over estimates that are not flagged
//   flagged, unanswered share of all frames: the estimate is flagged as uncertain; there is none
// Medians are over the frames with an estimate; a value without any frame is null.
// Images are path-traced, frames are noisy 8-bit sRGB of a camera at rest: the first is searched, the others are
// tracked. Errors are of all frames. Usage: --help.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "app/tag_body_finder.hpp"
#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "estimate/marker/shading.hpp"
#include "measure/output.hpp"
#include "measure/traced_frames.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::int64_t kFrameNs = 33'333'333;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_marker_trade: %s\n", what.c_str());
  std::exit(1);
}

struct Case {
  std::string what, knob;
  MarkerOptions marker;
};

std::string short_number(double v) { return formatted("%g", v); }

/// Each option at its values, including the default; equal cases differ only by the noise of timing.
std::vector<Case> all_cases() {
  std::vector<Case> out;
  const auto add = [&](const std::string& what, const std::string& knob) -> Case& {
    out.push_back({what, knob, {}});
    return out.back();
  };
  add("default", "setting");
  for (const double by : {1.0, 1.5, 2.0, 3.0, 4.0})
    add("followed / " + short_number(by), "decimation").marker.config.marker.decimation = by;
  for (const double by : {1.0, 1.5, 2.0, 3.0})
    add("searched / " + short_number(by), "search").marker.config.marker.search_decimation = by;
  for (const int faces : {1, 2, 3, 4, 0})
    add(faces == 0   ? "all faces"
        : faces == 1 ? "1 face"
                     : std::to_string(faces) + " faces",
        "faces")
        .marker.config.marker.max_faces = faces;
  for (const int lamps : {0, 1, 2, 3})
    add(lamps == 1 ? "1 lamp" : std::to_string(lamps) + " lamps", "order").marker.config.max_lights = lamps;
  // No face points down, so that no ground plane is sampled.
  add("no table", "order").marker.sampler.up = Vec3d{};
  return out;
}

/// Results of one case so far.
struct Tally {
  std::vector<double> ms, ms_first, rms, direction_deg;
  double worst_unflagged_deg = -1;
  int frames = 0, flagged = 0, unanswered = 0;
  bool verbose = false;
};

/// With two lamps, the weaker one may be the first estimated light: the smallest angle counts.
std::optional<double> direction_error_deg(const measure::TracedFrame& frame,
                                          const std::vector<marker::LightEstimate>& lights) {
  std::optional<double> out;
  for (std::size_t k = 0; k < std::min(lights.size(), frame.lamps.size()); ++k) {
    const double deg = angle_between(lights[k].light.direction, frame.lamps[0].direction) / kDegree;
    if (!out || deg < *out) out = deg;
  }
  return out;
}

void evaluate(const measure::TracedFrame& frame, const measure::TrueIrradiance& truth, bool answered,
              const Descriptor& answer, const MarkerReport& report, Tally& tally) {
  ++tally.frames;
  if (!answered) {
    ++tally.unanswered;
    return;
  }
  const bool unsure = answer.flags.has(Flag::unsure);
  tally.flagged += unsure ? 1 : 0;
  tally.rms.push_back(measure::irradiance_error(truth, answer));
  const std::optional<double> deg = direction_error_deg(frame, report.light.lights);
  if (tally.verbose)
    std::fprintf(
        stderr, "%s: RMS %.4f, direction %.2f deg, lamps %zu, faces %d, %s%s\n", frame.name.c_str(), tally.rms.back(),
        deg.value_or(-1), report.light.lights.size(), report.counts.faces,
        report.light.surround_model == marker::SurroundModel::ground_plane_with_shadow ? "shadow" : "faces alone",
        unsure ? ", unsure" : "");
  if (!deg) return;
  tally.direction_deg.push_back(*deg);
  if (!unsure) tally.worst_unflagged_deg = std::max(tally.worst_unflagged_deg, *deg);
}

/// One case with one image: a camera at rest; the first frame needs a full search, in the others the body is tracked.
class Stream {
 public:
  Stream(const Case& of, const MarkerBody& body, const RigParameters& rig) : what_(of.what) {
    Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, body);
    if (!finder) fail(what_ + ": " + finder.status().message());
    auto estimator = make_marker_estimator(rig, body, std::move(*finder), of.marker);
    if (!estimator) fail(what_ + ": " + estimator.status().message());
    estimator_ = std::move(*estimator);
  }

  /// Processes all frames, in later calls all but the first. The results are added to `tally` if it is not null.
  void process(const measure::TracedFrame& frame, const measure::TrueIrradiance& truth,
               std::vector<measure::Shot>& shots, Tally* tally) {
    best_ms_.resize(shots.size(), std::numeric_limits<double>::infinity());
    for (std::size_t k = frames_ == 0 ? 0 : 1; k < shots.size(); ++k) {
      shots[k].frames.front().info.mid_exposure = ProbeTime{++frames_ * kFrameNs};
      Descriptor out;
      const double begin = bench::thread_time_ms();
      const Status s = estimator_->estimate(shots[k].frames, out);
      const double spent = bench::thread_time_ms() - begin;
      if (!s.ok() && s.code() != StatusCode::not_found) fail(what_ + ", " + frame.name + ": " + s.message());
      // Later frames only count if the body was tracked: after a loss the whole image is searched.
      if (k == 0 || (s.ok() && answered_)) best_ms_[k] = std::min(best_ms_[k], spent);
      answered_ = s.ok();
      if (tally != nullptr) evaluate(frame, truth, s.ok(), out, estimator_->report(), *tally);
    }
  }

  void add_times(Tally& tally) const {
    double sum = 0;
    int count = 0;
    for (std::size_t k = 1; k < best_ms_.size(); ++k)
      if (std::isfinite(best_ms_[k])) sum += best_ms_[k], ++count;
    if (count > 0) tally.ms.push_back(sum / count);
    tally.ms_first.push_back(best_ms_[0]);
  }

 private:
  std::string what_;
  std::unique_ptr<MarkerEstimator> estimator_;
  std::vector<double> best_ms_;
  std::int64_t frames_ = 0;
  bool answered_ = false;  ///< Whether the previous frame gave an estimate.
};

void print(const Case& of, const Tally& tally, int width, int height, double memcpy_ms) {
  const double ms = median(std::vector(tally.ms)),
               worst = tally.rms.empty() ? std::nan("") : *std::max_element(tally.rms.begin(), tally.rms.end());
  measure::print_line(
      {{"what", of.what},
       {"knob", of.knob},
       {"width", width},
       {"height", height},
       {"ms", ms},
       {"ms_first", median(std::vector(tally.ms_first))},
       {"memcpy_ratio", ms / memcpy_ms},
       {"rms", median(std::vector(tally.rms))},
       {"worst_rms", worst},
       {"direction_deg", median(std::vector(tally.direction_deg))},
       {"worst_direction_deg", tally.worst_unflagged_deg < 0 ? std::nan("") : tally.worst_unflagged_deg},
       {"flagged", static_cast<double>(tally.flagged) / tally.frames},
       {"unanswered", static_cast<double>(tally.unanswered) / tally.frames}});
}

}  // namespace

int main(int argc, char** argv) {
  std::string frames_folder = LIGHTWELL_MARKER_FRAMES, bodies_folder = LIGHTWELL_MARKER_BODIES, group, only;
  int followed = 4, runs = 5;
  bool verbose = false;
  CLI::App app{"Cost and benefit of the marker estimator's decimation, faces and lights.", "measure_marker_trade"};
  app.add_option("--followed", followed, "Noisy frames of each image after the first one [4]")
      ->check(CLI::PositiveNumber);
  app.add_option("--runs", runs, "Runs of which the best time of each tracked frame counts [5]")
      ->check(CLI::PositiveNumber);
  app.add_option("--group", group, "grid, two or near [all three]");
  app.add_option("--case", only, "One case [all]");
  app.add_flag("--verbose", verbose, "Errors of every frame on standard error");
  app.add_option("--frames", frames_folder, "Folder of scenes.json and the images [tests/reference/mitsuba/marker]");
  app.add_option("--bodies", bodies_folder, "Folder of the marker bodies [firmware/estimate/marker/bodies]");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const auto frames = measure::load_traced_frames(frames_folder);
  if (!frames) fail(frames.status().message());
  const auto bodies = measure::load_traced_bodies(bodies_folder);
  if (!bodies) fail(bodies.status().message());
  std::vector<Case> cases = all_cases();
  if (!only.empty()) std::erase_if(cases, [&](const Case& c) { return c.what != only; });
  if (cases.empty()) fail("no case '" + only + "'");
  std::vector<Tally> tallies(cases.size());
  for (Tally& tally : tallies) tally.verbose = verbose;
  int width = 0, height = 0;
  std::uint64_t number = 0;
  for (const measure::TracedFrame& frame : *frames) {
    const bool swept = frame.group == "grid" || frame.group == "two" || frame.group == "near";
    if (!swept || (!group.empty() && frame.group != group)) continue;
    const LensParameters& lens = frame.rig.lenses.front();
    if (width == 0) width = lens.width, height = lens.height;
    if (lens.width != width || lens.height != height) fail(frame.name + " has another size than the previous images");
    const MarkerBody& body = bodies->at(frame.body);
    const auto picture = measure::TracedPicture::load(frames_folder, frame, body);
    if (!picture) fail(picture.status().message());
    measure::TracedSensor sensor;
    sensor.srgb = true;
    const RigParameters rig = picture->rig_for(sensor);
    std::vector<measure::Shot> shots;
    for (int k = 0; k <= followed; ++k) shots.push_back(picture->expose(sensor, number++));
    const measure::TrueIrradiance truth = measure::irradiance_facing_camera(frame);
    std::vector<Stream> streams;
    for (const Case& one : cases) streams.emplace_back(one, body, rig);
    // Cases alternate, so that a temporary slowdown of the machine affects all of them.
    for (int run = 0; run < runs; ++run)
      for (std::size_t i = 0; i < cases.size(); ++i)
        streams[i].process(frame, truth, shots, run == 0 ? &tallies[i] : nullptr);
    for (std::size_t i = 0; i < cases.size(); ++i) streams[i].add_times(tallies[i]);
  }
  if (width == 0) fail("no frames of that group");
  const double memcpy_ms =
      1e3 *
      bench::memcpy_speed(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)).seconds_per_copy;
  for (std::size_t i = 0; i < cases.size(); ++i) print(cases[i], tallies[i], width, height, memcpy_ms);
  return 0;
}
