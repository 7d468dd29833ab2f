// Error of descriptors over the real panoramas: prints one JSON object per scene for tests/figures.
//   measure_accuracy [--epsilon E] [--setting S] [--sensor FORMAT] [--all]
// --sensor rgb8|bayer_rggb8|nv12|yuyv|...: a bracket of three exposures with noise and vignetting; default: an ideal
// sensor. Also the error of ARCore- and ARKit-style output for the same light, computed from the panorama itself, so
// that lenses and pixels cause no error.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include <nlohmann/json.hpp>

#include <lightwell/query.hpp>

#include "bench/ar_output.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_accuracy: %s\n", s.message().c_str());
  std::exit(1);
}

ref::Rgb color(const bench::Triple& t) { return {t[0], t[1], t[2]}; }

struct Peers {
  double arcore = 0, arcore_direction_deg = 0, arkit = 0;
};

Peers peers(const measure::PanoramaTruth& truth, const sim::Panorama& panorama) {
  const bench::EquirectImage image{panorama.width, panorama.height, panorama.rgb};
  const bench::ArcoreOutput arcore = bench::arcore_output(image);
  const bench::ArkitOutput arkit = bench::arkit_output(image);
  const auto error = [&](const auto& output) {
    return measure::irradiance_error(truth,
                                     [&](const ref::V3& n) {
                                       return color(bench::irradiance_of(output, {n.x, n.y, n.z}));
                                     })
        .rms;
  };
  const bench::Triple& d = arcore.main_direction;
  return {error(arcore), ref::angle_deg({d[0], d[1], d[2]}, truth.brightest->direction), error(arkit)};
}

void measure_scene(const std::string& path, PixelFormat format, const PanoramaOptions& options) {
  const Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(path);
  if (!truth) fail(truth.status());
  Result<sim::Panorama> panorama = sim::load_panorama(path);
  if (!panorama) fail(panorama.status());
  const Peers others = peers(*truth, *panorama);
  const sim::Scene scene(std::move(*panorama));
  const RigParameters rig = *sim::make_rig("pair", 640, 480, format);
  measure::Camera camera(rig, format);
  const measure::LensRadiance radiance = camera.render(scene, scene.state_at(0));
  const std::vector<double> exposures = camera.bracket_of_three(measure::peak_of(radiance), measure::mean_of(radiance));
  const measure::Shot shot = camera.expose(radiance, exposures, 0);

  auto estimator = make_panorama_estimator(rig, options);
  if (!estimator) fail(estimator.status());
  const Result<measure::Delivered> delivered = measure::deliver(**estimator, shot);
  if (!delivered) fail(delivered.status());
  const Descriptor& d = delivered->descriptor;

  const ref::IrradianceError e = measure::irradiance_error(*truth, [&](const ref::V3& n) {
    const Irradiance v = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
    return ref::Rgb{v.r, v.g, v.b};
  });
  double nearest = 180;
  for (const Light& l : d.lights)
    nearest =
        std::min(nearest, ref::angle_deg({l.direction.x, l.direction.y, l.direction.z}, truth->brightest->direction));
  measure::print_line({{"scene", truth->name},
                       {"sensor", to_string(format)},
                       {"bytes", delivered->bytes},
                       {"lights", d.lights.size()},
                       {"band", d.radiance.band},
                       {"flagged", std::isfinite(d.bound.total) ? 0 : 1},
                       {"error", e.rms},
                       {"weighted", e.luminance_weighted},
                       {"largest", e.largest},
                       {"bound", d.bound.total},
                       {"truncation", d.bound.truncation},
                       {"sampling", d.bound.sampling},
                       {"noise", d.bound.noise},
                       {"quantization", d.bound.quantization},
                       {"direction_deg", nearest},
                       {"peak", truth->brightest->peak_to_mean},
                       {"region_radius_deg", truth->brightest->solid_angle_radius_rad * 180 / std::numbers::pi},
                       {"stops", std::log2(exposures.back() / exposures.front())},
                       {"arcore", others.arcore},
                       {"arcore_direction_deg", others.arcore_direction_deg},
                       {"arkit", others.arkit}});
}

}  // namespace

int main(int argc, char** argv) {
  PanoramaOptions options;
  options.probe_id = fnv1a_32("lightwell");
  PixelFormat format = PixelFormat::rgb_f32;
  bool all = false;
  CLI::App app{"Error of descriptors over the real panoramas.", "measure_accuracy"};
  app.add_option("--epsilon", options.config.panorama.epsilon, "Error of irradiance that may be left [0.01]");
  add_named_option(app, "--setting", options.config.setting, kSettings, "fastest, fast, balanced or exact [balanced]");
  add_named_option(app, "--sensor", format, kPixelFormats, "rgb8, bayer_rggb8, nv12, yuyv, ... [an ideal sensor]");
  app.add_flag("--all", all, "All 26 panoramas instead of eight");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const Result<std::vector<std::string>> paths = all ? measure::all_panoramas() : measure::eight_panoramas();
  if (!paths) fail(paths.status());
  for (const std::string& path : *paths) measure_scene(path, format, options);
  return 0;
}
