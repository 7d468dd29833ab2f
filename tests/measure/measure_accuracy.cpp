// How far descriptors are from the truth, over the real panoramas: prints one JSON object a line for tests/figures.
//   measure_accuracy [--epsilon E] [--setting S] [--all]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/panorama_truth.hpp"
#include "sim/panorama.hpp"
#include "sim/render.hpp"
#include "sim/rigs.hpp"
#include "sim/sensor.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_accuracy: %s\n", s.message().c_str());
  std::exit(1);
}

struct Shot {
  std::vector<std::vector<std::byte>> pixels;
  std::vector<Frame> frames;
};

Shot shoot(const sim::Scene& scene, const RigParameters& rig, PixelFormat format, const std::vector<double>& exposures) {
  Shot out;
  sim::SensorModel model = sim::sensor_of(rig, format, 1);
  for (std::size_t e = 0; e < exposures.size(); ++e) {
    Frame frame;
    frame.info.exposure_s = exposures[e];
    frame.info.mid_exposure = {1'000'000};
    for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
      const LensParameters& lens = rig.lenses[k];
      const std::vector<float> radiance = sim::render_radiance(scene, scene.state_at(0), lens, sim::samples_for(lens, scene.panorama(scene.state_at(0))));
      const sim::Sensor sensor(lens, model);
      out.pixels.emplace_back(sensor.bytes());
      sensor.develop(radiance, {exposures[e], 1, e, static_cast<int>(k)}, out.pixels.back());
      frame.add_view({static_cast<int>(k), format, lens.width, lens.height, sensor.stride(), out.pixels.back()});
    }
    out.frames.push_back(std::move(frame));
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  PanoramaOptions options;
  bool all = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--epsilon") == 0 && i + 1 < argc) options.config.epsilon = std::atof(argv[++i]);
    else if (std::strcmp(argv[i], "--setting") == 0 && i + 1 < argc) {
      for (const Setting s : kSettings)
        if (to_string(s) == argv[i + 1]) options.config.setting = s;
      ++i;
    } else if (std::strcmp(argv[i], "--all") == 0) all = true;
    else return std::fprintf(stderr, "usage: measure_accuracy [--epsilon E] [--setting fast|balanced|exact] [--all]\n"), 2;
  }
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  Result<std::vector<std::string>> paths = all ? measure::all_panoramas() : measure::eight_panoramas();
  if (!paths) fail(paths.status());
  for (const std::string& path : *paths) {
    Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(path);
    if (!truth) fail(truth.status());
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    if (!panorama) fail(panorama.status());
    const sim::Scene scene(std::move(*panorama));
    const Shot shot = shoot(scene, rig, PixelFormat::rgb_f32, {1.0});
    auto estimator = make_panorama_estimator(rig, options);
    if (!estimator) fail(estimator.status());
    Descriptor made;
    if (const Status s = (*estimator)->estimate(shot.frames, made); !s.ok()) fail(s);
    Encoder encoder;
    const auto bytes = encoder.encode(made);
    if (!bytes) fail(bytes.status());
    const Descriptor d = *decode_descriptor(*bytes);
    const ref::IrradianceError e = measure::irradiance_error(*truth, [&](const ref::V3& n) {
      const Irradiance v = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
      return ref::Rgb{v.r, v.g, v.b};
    });
    double nearest = 180;
    for (const Light& l : d.lights)
      nearest = std::min(nearest, ref::angle_deg({l.direction.x, l.direction.y, l.direction.z}, truth->brightest->direction));
    std::printf("{\"scene\": \"%s\", \"error\": %.5f, \"weighted\": %.5f, \"bound\": %.5f, \"truncation\": %.5f, \"sampling\": %.5f, \"quantization\": %.5f, \"bytes\": %zu, \"lights\": %zu, \"band\": %d, \"direction_deg\": %.3f, \"peak\": %.0f}\n",
                truth->name.c_str(), e.rms, e.luminance_weighted, static_cast<double>(d.bound.total), static_cast<double>(d.bound.truncation), static_cast<double>(d.bound.sampling), static_cast<double>(d.bound.quantization), bytes->size(), d.lights.size(), d.radiance.band, nearest, truth->brightest->peak_to_mean);
    std::fflush(stdout);
  }
  return 0;
}
