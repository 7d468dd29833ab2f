// Interleaved sampling (panorama.interleave, and the setting fastest) against whole frames, in real panoramas: prints
// one JSON object per case and choice for tests/figures, over all scenes.
//   measure_interleave [--frames N] [--case CASE] [--format FORMAT]     frames of each scene and case [64]; one case
//                                                                       [all]; pixel format [bayer12]
// Cases: still, and switched, in the 26 panoramas: lamps go on and off every second without light on other surfaces,
// which is the hardest case, because no run that is read tells of it; turning, in eight of them: the probe rotates by
// 30 degrees per second, and lamps are switched, too. One exposure, in which no pixel saturates. Brackets: the same as
// still with three exposures. Two lenses of 640x480, with noise; smoothing is off, so that each frame stands for
// itself. Frames with an infinite bound count as flagged. "unread": the first N - 1 frames after a switch. Choices:
// each interleave at balanced, fastest, exact, and exact with the interleave of fastest. At rest, one more object for
// each bound that may be asked of descriptors: of how many scenes each point of the governor of bounds is the cheapest
// whose bound holds in every frame.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/bound_statistics.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

constexpr int kInterleaves[] = {1, 2, 4, 8, 16};
constexpr double kTurnRadPerS = 30 * std::numbers::pi / 180;
constexpr std::uint64_t kSwitchFrames = 30;
enum class Case { still, switched, turning, brackets };
constexpr const char* kCases[] = {"still", "switched", "turning", "brackets"};

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_interleave: %s\n", s.message().c_str());
  std::exit(1);
}

struct Frames {
  measure::BoundStatistics bounds;
  std::vector<double> differences;  ///< To the answers of whole frames, of frames that are not flagged.

  void add(double error, double bound, double difference) {
    bounds.add(error, bound);
    if (std::isfinite(bound)) differences.push_back(difference);
  }
  [[nodiscard]] nlohmann::json summary() const {
    nlohmann::json out = bounds.json();
    out["median_difference"] = upper_quantile(std::vector(differences), 0.5);
    out["worst_difference"] = differences.empty() ? 0 : std::ranges::max(differences);
    return out;
  }
};

struct Probe {
  Setting setting;
  int interleave;
  std::unique_ptr<Estimator> estimator{};
  Frames read{}, unread{};
  std::vector<double> largest_bounds{};  ///< By scene.
};

/// Asked of descriptors.
constexpr double kAskedBounds[] = {0.01, 0.02, 0.03, 0.05};

void print_cheapest(const char* which, const std::string& format, const std::vector<Probe>& probes,
                    std::size_t scenes) {
  constexpr struct {
    Setting setting;
    int interleave;
  } kPoints[] = {{Setting::fastest, kMaxInterleave},
                 {Setting::balanced, kMaxInterleave},
                 {Setting::exact, kMaxInterleave},
                 {Setting::exact, 1}};
  for (const double asked : kAskedBounds) {
    nlohmann::json counts = {{"none", 0}};
    for (std::size_t scene = 0; scene < scenes; ++scene) {
      std::string cheapest = "none";
      for (const auto& point : kPoints) {
        const auto probe = std::ranges::find_if(
            probes, [&](const Probe& p) { return p.setting == point.setting && p.interleave == point.interleave; });
        const std::string name = std::string(to_string(point.setting)) + " " + std::to_string(point.interleave);
        if (!counts.contains(name)) counts[name] = 0;
        if (cheapest == "none" && probe->largest_bounds[scene] <= asked) cheapest = name;
      }
      counts[cheapest] = counts[cheapest].get<int>() + 1;
    }
    measure::print_line(
        {{"case", which}, {"format", format}, {"asked_bound", asked}, {"scenes", scenes}, {"cheapest", counts}});
  }
}

measure::PanoramaTruth truth_of(const sim::Panorama& p) {
  return measure::panorama_truth("", {p.width, p.height, {p.rgb.begin(), p.rgb.end()}});
}

std::vector<ref::Rgb> irradiance_of(const Descriptor& d, Quat to_probe) {
  std::vector<ref::Rgb> out;
  for (const ref::V3& n : measure::truth_normals()) {
    const Irradiance v = irradiance_at(d, vec_cast<float>(rotate(to_probe, Vec3d{n.x, n.y, n.z})));
    out.push_back({v.r, v.g, v.b});
  }
  return out;
}

double error_of(const std::vector<ref::Rgb>& truth, const std::vector<ref::Rgb>& got) {
  const ref::IrradianceError e = ref::irradiance_error(truth, got);
  return std::max(e.rms, e.luminance_weighted);
}

void measure_scene(measure::Camera& camera, const std::string& path, Case which, int frames,
                   std::vector<Probe>& probes) {
  Result<sim::Panorama> panorama = sim::load_panorama(path);
  if (!panorama) fail(panorama.status());
  sim::Motion motion;
  motion.turn_rad_per_s = which == Case::turning ? kTurnRadPerS : 0;
  motion.cycle_frames = 4096;  // Longer than any run, so that the rotation does not reverse.
  motion.switch_period_frames = which == Case::switched || which == Case::turning ? kSwitchFrames : 0;
  const sim::Scene scene(std::move(*panorama), motion);
  sim::SceneState off = scene.state_at(0);
  off.lamp_factor = motion.off_factor;
  const measure::PanoramaTruth lit = truth_of(scene.panorama(scene.state_at(0))), unlit = truth_of(scene.panorama(off));
  const sim::Panorama& bright = scene.panorama(scene.state_at(0));
  std::vector<double> exposures = camera.bracket_of_three(measure::peak_of(bright.rgb), sim::mean_luminance(bright));
  if (which != Case::brackets) exposures.resize(1);
  for (Probe& probe : probes) probe.largest_bounds.push_back(0);
  measure::LensRadiance radiance;
  double rendered = -1, lamps = -1;
  int since_switch = 1000;
  for (int i = 0; i < frames; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    const sim::SceneState state = scene.state_at(index);
    if (which == Case::turning || state.lamp_factor != rendered) radiance = camera.render(scene, state);
    rendered = state.lamp_factor;
    since_switch = lamps >= 0 && state.lamp_factor != lamps ? 0 : since_switch + 1;
    lamps = state.lamp_factor;
    const measure::Shot shot = camera.expose(radiance, exposures, index);
    std::vector<ref::Rgb> whole;
    for (Probe& probe : probes) {
      // The clock does not advance at the first frame of a scene: it is read whole.
      const Result<measure::Delivered> out = measure::deliver(*probe.estimator, shot);
      if (!out) fail(out.status());
      const auto got = irradiance_of(out->descriptor, state.rotation_world_probe.inverse());
      if (whole.empty()) whole = got;
      probe.largest_bounds.back() =
          std::max(probe.largest_bounds.back(), static_cast<double>(out->descriptor.bound.total));
      Frames& of = since_switch < probe.interleave - 1 ? probe.unread : probe.read;
      of.add(error_of((state.lamp_factor < 1 ? unlit : lit).irradiance, got), out->descriptor.bound.total,
             error_of(whole, got));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  int frames = 64;
  std::string only, format_name = "bayer12";
  CLI::App app{"Compares interleaved sampling with whole frames in real panoramas.", "measure_interleave"};
  app.add_option("--frames", frames, "Frames of each scene and case [64]")->check(CLI::PositiveNumber);
  app.add_option("--case", only, "still, switched, turning or brackets [all]")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kCases), std::end(kCases))));
  app.add_option("--format", format_name, "Pixel format [bayer12]");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const Result<std::vector<std::string>> all = measure::all_panoramas(), eight = measure::eight_panoramas();
  if (!all) fail(all.status());
  if (!eight) fail(eight.status());
  const std::optional<PixelFormat> format = pixel_format_of(format_name);
  if (!format) return wrong_usage(app, "unknown --format '" + format_name + "'");
  measure::Camera camera(*sim::make_rig("pair", 640, 480, *format), *format);
  std::vector<Probe> probes;
  const auto add_probe = [&](Setting setting, int interleave) {
    PanoramaOptions options;
    options.config.setting = setting;
    options.config.panorama.smoothing = Smoothing::none;
    options.config.panorama.interleave = interleave;
    auto estimator = make_panorama_estimator(camera.rig(), options);
    if (!estimator) fail(estimator.status());
    probes.push_back({setting, interleave, std::move(*estimator)});
  };
  // The first one gives what the others are compared with.
  for (const int interleave : kInterleaves) add_probe(Setting::balanced, interleave);
  add_probe(Setting::fastest, kMaxInterleave);
  for (const int interleave : {1, kMaxInterleave}) add_probe(Setting::exact, interleave);
  for (const Case which : {Case::still, Case::switched, Case::turning, Case::brackets}) {
    const std::vector<std::string>& paths = which == Case::turning ? *eight : *all;
    const char* name = kCases[static_cast<int>(which)];
    if (!only.empty() && only != name) continue;
    for (Probe& probe : probes) {
      probe.read = probe.unread = {};
      probe.largest_bounds.clear();
    }
    for (const std::string& path : paths) measure_scene(camera, path, which, frames, probes);
    for (const Probe& probe : probes)
      measure::print_line({{"case", name},
                           {"format", format_name},
                           {"setting", to_string(probe.setting)},
                           {"interleave", probe.interleave},
                           {"scenes", paths.size()},
                           {"read", probe.read.summary()},
                           {"unread", probe.unread.summary()}});
    if (which == Case::still || which == Case::brackets) print_cheapest(name, format_name, probes, paths.size());
  }
  return 0;
}
