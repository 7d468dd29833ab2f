// Brackets of three exposures: how long they take beside memcpy of all three, and how far the light of the real panoramas
// is from the truth through a noisy sensor with vignetting. Prints one JSON object a line for tests/figures.
//   measure_brackets speed|accuracy
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/speed_bench.hpp"
#include "sim/panorama.hpp"
#include "sim/render.hpp"
#include "sim/rigs.hpp"
#include "sim/sensor.hpp"

namespace {

using namespace lightwell;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_brackets: %s\n", s.message().c_str());
  std::exit(1);
}

sim::Scene scene_of(const std::string& path) {
  Result<sim::Panorama> panorama = sim::load_panorama(path);
  if (!panorama) fail(panorama.status());
  return sim::Scene(std::move(*panorama));
}

void speed(const sim::Scene& scene) {
  for (const char* rig : {"equirect", "pair"}) {
    measure::SpeedCase c;
    c.rig = rig;
    // As many pixels as 1280x960, twice as wide as high.
    c.width = std::strcmp(rig, "equirect") == 0 ? 1568 : 1280;
    c.height = std::strcmp(rig, "equirect") == 0 ? 784 : 960;
    c.exposures = {1e-5, 3e-4, 1e-2};
    const auto one = [&](const std::string& name) {
      const measure::Speed s = measure_speed(scene, c);
      std::printf("{\"figure\": \"bracket.%s.%s\", \"value\": %.4g, \"ms\": %.4g, \"memcpy_gb_per_s\": %.3g}\n", rig,
                  name.c_str(), s.seconds / s.memcpy_seconds, s.seconds * 1e3, s.bytes / s.memcpy_seconds * 1e-9);
      std::fflush(stdout);
    };
    c.linear = true;
    one("rgb8_linear");
    c.linear = false;
    for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bayer_rggb8, PixelFormat::nv12, PixelFormat::yuyv}) {
      c.format = format;
      one(std::string(to_string(format)));
    }
  }
}

struct Shot {
  std::vector<std::vector<std::byte>> pixels;
  std::vector<Frame> frames;
};

void accuracy(PixelFormat format) {
  const Result<std::vector<std::string>> paths = measure::eight_panoramas();
  if (!paths) fail(paths.status());
  std::vector<double> errors;
  for (const std::string& path : *paths) {
    const Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(path);
    if (!truth) fail(truth.status());
    const sim::Scene scene = scene_of(path);
    const RigParameters rig = *sim::make_rig("pair", 640, 480, format);
    const sim::SensorModel model = sim::sensor_of(rig, format, 1);
    const sim::Panorama& panorama = scene.panorama(scene.state_at(0));
    std::vector<std::vector<float>> radiance;
    for (const LensParameters& lens : rig.lenses)
      radiance.push_back(sim::render_radiance(scene, scene.state_at(0), lens, sim::samples_for(lens, panorama)));
    // Exposures that reach from the brightest pixel down to twice the mean, evenly in stops.
    double mean = 0, peak = 0;
    for (const auto& lens : radiance) {
      for (std::size_t i = 0; i < lens.size(); i += 3) {
        const double l = 0.2126 * lens[i] + 0.7152 * lens[i + 1] + 0.0722 * lens[i + 2];
        mean += l / (static_cast<double>(lens.size()) / 3 * 0.6 * 2);
        peak = std::max({peak, static_cast<double>(lens[i]), static_cast<double>(lens[i + 1]), static_cast<double>(lens[i + 2])});
      }
    }
    const double shortest = sim::exposure_below_saturation(model, peak, 1);
    const double longest = std::max(sim::exposure_below_saturation(model, 2 * mean, 1), 4 * shortest);
    const std::array<double, 3> exposures = {shortest, std::sqrt(shortest * longest), longest};
    Shot shot;
    for (std::size_t e = 0; e < exposures.size(); ++e) {
      Frame frame;
      frame.info.exposure_s = exposures[e];
      for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
        const LensParameters& lens = rig.lenses[k];
        const sim::Sensor sensor(lens, model);
        shot.pixels.emplace_back(sensor.bytes());
        sensor.develop(radiance[k], {exposures[e], 1, e, static_cast<int>(k)}, shot.pixels.back());
        frame.add_view({static_cast<int>(k), format, lens.width, lens.height, sensor.stride(), shot.pixels.back()});
      }
      shot.frames.push_back(std::move(frame));
    }
    auto estimator = make_panorama_estimator(rig, {});
    if (!estimator) fail(estimator.status());
    Descriptor d;
    if (const Status s = (*estimator)->estimate(shot.frames, d); !s.ok()) fail(s);
    const reference::IrradianceError e = measure::irradiance_error(*truth, [&](const reference::V3& n) {
      const Irradiance v = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
      return reference::Rgb{v.r, v.g, v.b};
    });
    errors.push_back(std::max(e.rms, e.luminance_weighted));
    std::printf("{\"scene\": \"%s\", \"format\": \"%s\", \"error\": %.5f, \"bound\": %.5f, \"noise\": %.5f, \"clipped\": %d, \"moved\": %d, \"stops\": %.1f, \"lights\": %zu}\n",
                truth->name.c_str(), std::string(to_string(format)).c_str(), errors.back(), static_cast<double>(d.bound.total),
                static_cast<double>(d.bound.noise), d.flags.has(Flag::clipped), d.flags.has(Flag::moved),
                std::log2(longest / shortest), d.lights.size());
    std::fflush(stdout);
  }
  std::sort(errors.begin(), errors.end());
  std::printf("{\"figure\": \"accuracy.bracket.%s\", \"largest\": %.5f, \"median\": %.5f}\n",
              std::string(to_string(format)).c_str(), errors.back(), 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::strcmp(argv[1], "speed") == 0) {
    const Result<std::string> path = sim::scene_path("city");
    if (!path) fail(path.status());
    speed(scene_of(*path));
    return 0;
  }
  if (argc == 2 && std::strcmp(argv[1], "accuracy") == 0) {
    for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bayer_rggb8, PixelFormat::nv12, PixelFormat::yuyv})
      accuracy(format);
    return 0;
  }
  return std::fprintf(stderr, "usage: measure_brackets speed|accuracy\n"), 2;
}
