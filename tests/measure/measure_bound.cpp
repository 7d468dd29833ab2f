// Compares the descriptor's error bound with the true error over a run of frames in every real panorama: prints one
// JSON object per scene and sensor for tests/figures, and one per sensor for all scenes.
//   measure_bound [--frames N]     frames in each of the 26 panoramas [40]
// The probe rotates by 30 degrees per second and the lamps switch every second, as in topic skeleton; temporal
// smoothing is on, so its error counts. Sensors: ideal; rgb8, nv12 and bayer_rggb8 with noise, vignetting and three
// simultaneous exposures. Frames with an infinite bound count as flagged, neither as held nor as missed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>

#include <nlohmann/json.hpp>

#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/bound_statistics.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

constexpr PixelFormat kSensors[] = {PixelFormat::rgb_f32, PixelFormat::rgb8, PixelFormat::nv12,
                                    PixelFormat::bayer_rggb8};
constexpr double kTurnRadPerS = 30 * std::numbers::pi / 180;
constexpr std::uint64_t kSwitchFrames = 30;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_bound: %s\n", s.message().c_str());
  std::exit(1);
}

void print(const std::string& scene, PixelFormat format, const measure::BoundStatistics& run) {
  nlohmann::json line = run.json();
  line["scene"] = scene;
  line["sensor"] = to_string(format);
  measure::print_line(line);
}

/// Ground truth of the panorama in this state of its lamps.
measure::PanoramaTruth truth_of(const sim::Panorama& p) {
  return measure::panorama_truth("", {p.width, p.height, {p.rgb.begin(), p.rgb.end()}});
}

Descriptor delivered(Estimator& estimator, const measure::Shot& shot) {
  Result<measure::Delivered> out = measure::deliver(estimator, shot);
  if (!out) fail(out.status());
  return std::move(out->descriptor);
}

}  // namespace

int main(int argc, char** argv) {
  int frames = 40;
  CLI::App app{"Compares the descriptor's error bound with the true error in every real panorama.", "measure_bound"};
  app.add_option("--frames", frames, "Frames in each panorama [40]")->check(CLI::PositiveNumber);
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const Result<std::vector<std::string>> paths = measure::all_panoramas();
  if (!paths) fail(paths.status());

  struct Probe {
    measure::Camera camera;
    std::unique_ptr<Estimator> estimator{};
    std::vector<double> exposures{};
    measure::BoundStatistics run{};
  };
  std::vector<Probe> probes;
  for (const PixelFormat format : kSensors)
    probes.push_back({measure::Camera(*sim::make_rig("pair", 640, 480, format), format)});
  std::map<PixelFormat, measure::BoundStatistics> whole;
  for (const std::string& path : *paths) {
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    if (!panorama) fail(panorama.status());
    sim::Motion motion;
    motion.turn_rad_per_s = kTurnRadPerS;
    motion.cycle_frames = 4096;  // Longer than any run, so that the rotation does not reverse.
    motion.switch_period_frames = kSwitchFrames;
    const sim::Scene scene(std::move(*panorama), motion);
    sim::SceneState off = scene.state_at(0);
    off.lamp_factor = motion.off_factor;
    const measure::PanoramaTruth lit = truth_of(scene.panorama(scene.state_at(0))),
                                 unlit = truth_of(scene.panorama(off));

    // One bracket for the whole run, in which no pixel saturates at any orientation.
    const sim::Panorama& bright = scene.panorama(scene.state_at(0));
    const double peak = measure::peak_of(bright.rgb), mean = sim::mean_luminance(bright);
    for (Probe& probe : probes) {
      auto estimator = make_panorama_estimator(probe.camera.rig(), {});
      if (!estimator) fail(estimator.status());
      probe.estimator = std::move(*estimator);
      probe.exposures = probe.camera.bracket_of_three(peak, mean);
      probe.run = {};
    }
    for (int i = 0; i < frames; ++i) {
      const auto index = static_cast<std::uint64_t>(i);
      const sim::SceneState state = scene.state_at(index);
      const measure::LensRadiance radiance = probes.front().camera.render(scene, state);
      const measure::PanoramaTruth& truth = state.lamp_factor < 1 ? unlit : lit;
      const Quat to_probe = state.rotation_world_probe.inverse();
      for (Probe& probe : probes) {
        const Descriptor d = delivered(*probe.estimator, probe.camera.expose(radiance, probe.exposures, index));
        const ref::IrradianceError e = measure::irradiance_error(truth, [&](const ref::V3& n) {
          const Irradiance v = irradiance_at(d, vec_cast<float>(rotate(to_probe, Vec3d{n.x, n.y, n.z})));
          return ref::Rgb{v.r, v.g, v.b};
        });
        probe.run.add(std::max(e.rms, e.luminance_weighted), d.bound.total);
      }
    }
    const std::size_t slash = path.rfind('/') + 1;
    for (const Probe& probe : probes) {
      print(path.substr(slash, path.rfind('.') - slash), probe.camera.format(), probe.run);
      whole[probe.camera.format()].add(probe.run);
    }
  }
  for (const auto& [format, run] : whole) print("all", format, run);
  return 0;
}
