// Cost and accuracy for an application: bytes per second and query time against error, for bands, lights and sizes of
// the environment map, medians over the eight panoramas; from an ideal camera over the wire through the SDK. One JSON
// object per line for tests/figures, which draws them (figure_topics/trade_chart.py).
//     figure trade.bandL.lightsN.mapE: bytes (of a message), bytes_per_s (30 descriptors and 5 maps per second),
//     irradiance_ns, radiance_ns (roughness 0.33, a new direction each), irradiance_percent (proto/README.md's error),
//     silver_percent (RMS error of a matte silver ball relative to the RMS of the true one)
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/lighting.hpp>
#include <lightwell/quantile.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "measure/three_balls.hpp"
#include "sim/sensor.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

constexpr double kDescriptorsPerS = 30, kMapsPerS = 5;

struct Choice {
  int band = 0, lights = 0, edge = 0;
  [[nodiscard]] std::string name() const {
    return "band" + std::to_string(band) + ".lights" + std::to_string(lights) + ".map" + std::to_string(edge);
  }
};

/// Results of one choice for each panorama; medians are taken over them.
struct Cost {
  std::vector<double> bytes, bytes_per_s, irradiance_ns, radiance_ns, irradiance_percent, silver_percent;
};

double upper_median(std::vector<double> v) { return upper_quantile(v, 0.5); }

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_trade: %s\n", s.message().c_str());
  std::exit(1);
}

ref::Rgb rgb(const auto& v) { return {v.r, v.g, v.b}; }
Vec3f vec(const ref::V3& d) { return vec_cast<float>(Vec3d{d.x, d.y, d.z}); }

volatile float kept;  ///< Keeps the compiler from removing the computation.

/// Nanoseconds per call, best of five.
template <class Ask>
double ns_of_one(int calls, Ask&& ask) {
  const std::vector<ref::V3>& directions = measure::truth_normals();
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    float sum = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) sum += ask(vec(directions[static_cast<std::size_t>(i) * 7 % directions.size()]));
    best = std::min(best,
                    std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count() / calls);
    kept = sum;
  }
  return best;
}

std::vector<Choice> choices() {
  std::vector<Choice> all;
  for (const int band : {0, 1, 2, 4, 6})
    for (const int lights : {0, 1, 2, 4, 16}) all.push_back({band, lights, 0});
  for (const int band : {2, 4})
    for (const int edge : {8, 16, 32, 64}) all.push_back({band, 4, edge});
  return all;
}

}  // namespace

int main() {
  const Result<std::vector<std::string>> paths = measure::eight_panoramas();
  if (!paths) fail(paths.status());
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  measure::Camera camera(rig, PixelFormat::rgb_f32);
  const measure::BallView view(64);
  const auto silver = static_cast<std::size_t>(measure::Ball::matte_silver);
  const std::vector<Choice> all = choices();
  std::vector<Cost> costs(all.size());
  for (const std::string& path : *paths) {
    const Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(path);
    if (!truth) fail(truth.status());
    std::fprintf(stderr, "measure_trade: %s\n", truth->name.c_str());
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    if (!panorama) fail(panorama.status());
    const sim::Scene scene(std::move(*panorama));
    const double second[] = {1};
    const measure::Shot shot = camera.expose(camera.render(scene, scene.state_at(0)), second, 0);
    const measure::BallPictures true_balls = measure::ball_pictures(view, truth->sums);
    for (std::size_t i = 0; i < all.size(); ++i) {
      PanoramaOptions options;
      options.config.band = all[i].band;
      options.config.max_lights = all[i].lights;
      options.config.panorama.environment_edge = all[i].edge;
      // Everything that is allowed is sent, because the cost of each is measured.
      options.config.panorama.epsilon = 0;
      auto estimator = make_panorama_estimator(rig, options);
      if (!estimator) fail(estimator.status());
      Result<measure::Delivered> answer = measure::deliver(**estimator, shot);
      if (!answer) fail(answer.status());
      // A message without a map, for the descriptors between two maps.
      options.config.panorama.environment_edge = 0;
      auto plain = make_panorama_estimator(rig, options);
      if (!plain) fail(plain.status());
      const Result<measure::Delivered> without = measure::deliver(**plain, shot);
      if (!without) fail(without.status());
      const double bytes = static_cast<double>(answer->bytes), bare = static_cast<double>(without->bytes);
      const Lighting light = Lighting::of(std::move(answer->descriptor));
      Cost& cost = costs[i];
      cost.bytes.push_back(bytes);
      cost.bytes_per_s.push_back(kDescriptorsPerS * bare + (all[i].edge > 0 ? kMapsPerS * (bytes - bare) : 0));
      cost.irradiance_ns.push_back(ns_of_one(20'000, [&](Vec3f d) { return light.irradiance(d).value.r; }));
      cost.radiance_ns.push_back(ns_of_one(2'000, [&](Vec3f d) { return light.radiance(d, 0.33F).value.r; }));
      cost.irradiance_percent.push_back(100 * measure::irradiance_error(*truth, [&](const ref::V3& n) {
                                                return rgb(light.irradiance(vec(n)).value);
                                              }).rms);
      const measure::BallPictures ours = measure::ball_pictures(
          view, [&](const ref::V3& n) { return rgb(light.irradiance(vec(n)).value); },
          [&](const ref::V3& d, double roughness) {
            return rgb(light.radiance(vec(d), static_cast<float>(roughness)).value);
          });
      const measure::BallError e = measure::ball_error(true_balls[silver], ours[silver], 1);
      cost.silver_percent.push_back(100 * e.rmse / e.truth_rms);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    measure::print_line({{"figure", "trade." + all[i].name()},
                         {"bytes", upper_median(costs[i].bytes)},
                         {"bytes_per_s", upper_median(costs[i].bytes_per_s)},
                         {"irradiance_ns", upper_median(costs[i].irradiance_ns)},
                         {"radiance_ns", upper_median(costs[i].radiance_ns)},
                         {"irradiance_percent", upper_median(costs[i].irradiance_percent)},
                         {"silver_percent", upper_median(costs[i].silver_percent)}});
  return 0;
}
