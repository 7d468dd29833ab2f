// Cost and accuracy for an application: bytes per second and query time against error, for bands, lights and sizes of
// the environment map, medians over the eight panoramas; from an ideal camera over the wire through the SDK. One JSON
// object per line for tests/figures, and a chart.
//   measure_trade [PICTURE.png|.svg]
//     figure trade.bandL.lightsN.mapE: bytes (of a message), bytes_per_s (30 descriptors and 5 maps per second),
//     irradiance_ns, radiance_ns (roughness 0.33, a new direction each), irradiance_percent (proto/README.md's error),
//     silver_percent (RMS error of a matte silver ball relative to the RMS of the true one)
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <lightwell/lighting.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "measure/three_balls.hpp"
#include "sim/rigs.hpp"
#include "tools/lightwell_eval/drawing.hpp"

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

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

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

/// A log-log chart of error over cost with one mark per choice.
struct Panel {
  std::string title;
  double left;
  std::function<double(const Cost&)> cost, error;
  std::function<bool(const Choice&)> shows;
};

eval::Chart chart_of(const std::vector<Choice>& all, const std::vector<Cost>& costs) {
  constexpr double kWidth = 620, kHeight = 560, kTop = 90, kPad = 70;
  const eval::Ink black{30, 30, 34}, faint{226, 226, 230};
  const eval::Ink of_band[] = {{120, 120, 128}, {0, 114, 178}, {213, 94, 0}, {}, {0, 158, 115}, {}, {180, 60, 140}};
  eval::Chart chart;
  chart.width = 3 * kWidth;
  chart.height = kTop + kHeight + 60;
  chart.texts.push_back(
      {"What accuracy costs an application: medians of eight real panoramas, 30 descriptors and 5 maps a second",
       {20, 32},
       20,
       black,
       eval::Anchor::start,
       true});
  chart.texts.push_back(
      {"Colour: highest band (grey 0, blue 1, orange 2, green 4, violet 6). Number: lights; with a map its edge "
       "(squares).",
       {20, 58},
       15,
       black});
  const Panel panels[] = {
      {"irradiance error, %, over bytes a second", 0, [](const Cost& c) { return median(c.bytes_per_s); },
       [](const Cost& c) { return median(c.irradiance_percent); }, [](const Choice& c) { return c.edge == 0; }},
      {"irradiance error, %, over ns a query", kWidth, [](const Cost& c) { return median(c.irradiance_ns); },
       [](const Cost& c) { return median(c.irradiance_percent); }, [](const Choice& c) { return c.edge == 0; }},
      {"matte silver ball's error, %, over bytes a second", 2 * kWidth,
       [](const Cost& c) { return median(c.bytes_per_s); }, [](const Cost& c) { return median(c.silver_percent); },
       [](const Choice& c) { return c.edge > 0 || c.lights == 4; }}};
  for (const Panel& p : panels) {
    double x0 = 1e30, x1 = 0, y0 = 1e30, y1 = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!p.shows(all[i])) continue;
      x0 = std::min(x0, p.cost(costs[i])), x1 = std::max(x1, p.cost(costs[i]));
      y0 = std::min(y0, p.error(costs[i])), y1 = std::max(y1, p.error(costs[i]));
    }
    x0 /= 1.2, x1 *= 1.2, y0 /= 1.2, y1 *= 1.2;
    const auto px = [&](double v) {
      return p.left + kPad + (kWidth - kPad - 20) * std::log(v / x0) / std::log(x1 / x0);
    };
    const auto py = [&](double v) {
      return kTop + kHeight - kPad + 20 - (kHeight - kPad - 30) * std::log(v / y0) / std::log(y1 / y0);
    };
    const auto ticks = [](double from, double to) {
      std::vector<double> out;
      for (double decade = std::pow(10, std::floor(std::log10(from))); decade <= to; decade *= 10)
        for (const double m : {1.0, 2.0, 5.0})
          if (m * decade >= from && m * decade <= to) out.push_back(m * decade);
      return out;
    };
    char text[32];
    for (const double v : ticks(x0, x1)) {
      chart.strokes.push_back({{{px(v), py(y0)}, {px(v), py(y1)}}, faint});
      std::snprintf(text, sizeof text, "%g", v);
      chart.texts.push_back({text, {px(v), py(y0) + 18}, 13, black, eval::Anchor::middle});
    }
    for (const double v : ticks(y0, y1)) {
      chart.strokes.push_back({{{px(x0), py(v)}, {px(x1), py(v)}}, faint});
      std::snprintf(text, sizeof text, "%g", v);
      chart.texts.push_back({text, {px(x0) - 6, py(v) + 5}, 13, black, eval::Anchor::end});
    }
    chart.texts.push_back({p.title, {p.left + kPad, kTop - 4}, 15, black, eval::Anchor::start, true});
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!p.shows(all[i])) continue;
      const eval::ChartPoint at{px(p.cost(costs[i])), py(p.error(costs[i]))};
      chart.marks.push_back({at, 5, of_band[all[i].band], true, all[i].edge > 0});
      chart.texts.push_back({std::to_string(all[i].edge > 0 ? all[i].edge : all[i].lights),
                             {at.x + 7, at.y - 5},
                             12,
                             of_band[all[i].band]});
    }
  }
  return chart;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2) return std::fprintf(stderr, "usage: measure_trade [PICTURE]\n"), 2;
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
    std::printf(
        "{\"figure\": \"trade.%s\", \"bytes\": %.5g, \"bytes_per_s\": %.5g, \"irradiance_ns\": %.4g, \"radiance_ns\": "
        "%.4g, "
        "\"irradiance_percent\": %.4g, \"silver_percent\": %.4g}\n",
        all[i].name().c_str(), median(costs[i].bytes), median(costs[i].bytes_per_s), median(costs[i].irradiance_ns),
        median(costs[i].radiance_ns), median(costs[i].irradiance_percent), median(costs[i].silver_percent));
  if (argc == 2) {
    const std::string picture = argv[1];
    const eval::Chart chart = chart_of(all, costs);
    if (const Status s = picture.ends_with(".svg") ? write_svg(chart, picture) : write_png(chart, picture); !s.ok())
      fail(s);
  }
  return 0;
}
