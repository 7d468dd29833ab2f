// The size of a descriptor against its error (panorama.max_bytes) in the 26 real panoramas: prints one JSON object per
// setting and size for tests/figures.
//   measure_bytes [--format FORMAT]     pixel format [rgb_f32]
// Two lenses of 640x480; one exposure of floats, or three of an 8-bit sensor with noise; one frame of each panorama.
// Settings: exact, which uses all bytes that it may, and balanced, which stops at an error of 1 %. Sizes: 96, 128, 192,
// 256 bytes, and no limit. At exact each size is compared with epsilon alone, in steps of 6 % from 0.03 % to 60 %:
//   same_mean        all panoramas with one epsilon, the largest whose mean size is at least that of max_bytes
//   same_size        each panorama with its own epsilon: the least error of those whose message is no longer than
//                    max_bytes; ratios are error by max_bytes over that error
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
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

constexpr int kSizes[] = {96, 128, 192, 256, 0};
constexpr double kLeastEpsilon = 3e-4, kLargestEpsilon = 0.6, kEpsilonStep = 1.06;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_bytes: %s\n", s.message().c_str());
  std::exit(1);
}

struct Choice {
  EstimatorConfig config;
  std::unique_ptr<Estimator> estimator{};
  std::vector<double> bytes{}, errors{}, bounds{}, fixed{};  ///< By panorama.
};

Choice make_choice(const RigParameters& rig, const EstimatorConfig& config) {
  PanoramaOptions options;
  options.config = config;
  options.config.panorama.smoothing = Smoothing::none;
  options.probe_id = fnv1a_32("measure_bytes");
  auto made = make_panorama_estimator(rig, options);
  if (!made) fail(made.status());
  return {config, std::move(*made)};
}

/// Bytes of a message without its lights and harmonics.
double fixed_bytes(Descriptor d) {
  Encoder encoder;
  const std::size_t empty_radiance = 2 + 2 + 2 + 3;  // Two tags and lengths, the bands, three zeros.
  d.lights.clear();
  d.radiance = {};
  return static_cast<double>(encoder.encode(d)->size() - empty_radiance);
}

void measure_choice(Choice& choice, const measure::Shot& shot, const measure::PanoramaTruth& truth) {
  const Result<measure::Delivered> out = measure::deliver(*choice.estimator, shot);
  if (!out) fail(out.status());
  const ref::IrradianceError e = measure::irradiance_error(truth, [&](const ref::V3& n) {
    const Irradiance v = irradiance_at(out->descriptor, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
    return ref::Rgb{v.r, v.g, v.b};
  });
  choice.bytes.push_back(static_cast<double>(out->bytes));
  choice.errors.push_back(std::max(e.rms, e.luminance_weighted));
  choice.bounds.push_back(out->descriptor.bound.total);
  choice.fixed.push_back(fixed_bytes(out->descriptor));
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}
double median(const std::vector<double>& v) { return upper_quantile(std::vector(v), 0.5); }

nlohmann::json same_mean(const Choice& limited, const std::vector<Choice>& epsilons) {
  // Messages get shorter as epsilon rises.
  const Choice* same = &epsilons.front();
  for (const Choice& c : epsilons)
    if (mean(c.bytes) >= mean(limited.bytes)) same = &c;
  return {{"epsilon", same->config.panorama.epsilon},
          {"mean_bytes", mean(same->bytes)},
          {"median_error", median(same->errors)},
          {"worst_error", std::ranges::max(same->errors)}};
}

nlohmann::json same_size(const Choice& limited, const std::vector<Choice>& epsilons) {
  std::vector<double> ratios;
  int without = 0;
  for (std::size_t p = 0; p < limited.errors.size(); ++p) {
    std::optional<double> least;
    for (const Choice& c : epsilons)
      if (c.bytes[p] <= limited.config.panorama.max_bytes) least = std::min(least.value_or(c.errors[p]), c.errors[p]);
    if (least)
      ratios.push_back(limited.errors[p] / *least);
    else
      ++without;
  }
  return {{"median_ratio", upper_quantile(std::vector(ratios), 0.5)},
          {"worst_ratio", upper_quantile(std::vector(ratios), 1)},
          {"no_epsilon", without}};
}

}  // namespace

int main(int argc, char** argv) {
  std::string format_name = "rgb_f32";
  CLI::App app{"Measures sizes of descriptors against their errors in real panoramas.", "measure_bytes"};
  app.add_option("--format", format_name, "Pixel format [rgb_f32]");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  const Result<std::vector<std::string>> paths = measure::all_panoramas();
  if (!paths) fail(paths.status());
  const std::optional<PixelFormat> format = pixel_format_of(format_name);
  if (!format) return wrong_usage(app, "unknown --format '" + format_name + "'");
  measure::Camera camera(*sim::make_rig("pair", 640, 480, *format), *format);
  std::vector<Choice> choices, epsilons;
  for (const Setting setting : {Setting::exact, Setting::balanced})
    for (const int size : kSizes) {
      EstimatorConfig config;
      config.setting = setting;
      config.panorama.max_bytes = size;
      choices.push_back(make_choice(camera.rig(), config));
    }
  for (double epsilon = kLeastEpsilon; epsilon < kLargestEpsilon; epsilon *= kEpsilonStep) {
    EstimatorConfig config;
    config.panorama.epsilon = epsilon;
    epsilons.push_back(make_choice(camera.rig(), config));
  }
  for (const std::string& path : *paths) {
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    if (!panorama) fail(panorama.status());
    const measure::PanoramaTruth truth = measure::panorama_truth(
        path, {panorama->width, panorama->height, {panorama->rgb.begin(), panorama->rgb.end()}});
    const std::vector<double> exposures =
        camera.bracket_of_three(measure::peak_of(panorama->rgb), sim::mean_luminance(*panorama));
    const sim::Scene scene(std::move(*panorama));
    const measure::Shot shot = camera.expose(camera.render(scene, scene.state_at(0)), exposures, 0);
    for (Choice& c : choices) measure_choice(c, shot, truth);
    for (Choice& c : epsilons) measure_choice(c, shot, truth);
  }
  for (const Choice& c : choices) {
    measure::BoundStatistics bounds;
    for (std::size_t p = 0; p < c.errors.size(); ++p) bounds.add(c.errors[p], c.bounds[p]);
    nlohmann::json out = bounds.json();
    out.update({{"format", format_name},
                {"setting", to_string(c.config.setting)},
                {"max_bytes", c.config.panorama.max_bytes},
                {"mean_bytes", mean(c.bytes)},
                {"median_bytes", median(c.bytes)},
                {"largest_bytes", std::ranges::max(c.bytes)},
                {"worst_bound", std::ranges::max(c.bounds)},
                {"median_fixed", median(c.fixed)},
                {"largest_fixed", std::ranges::max(c.fixed)}});
    if (c.config.setting == Setting::exact && c.config.panorama.max_bytes > 0) {
      out["same_mean"] = same_mean(c, epsilons);
      out["same_size"] = same_size(c, epsilons);
    }
    measure::print_line(out);
  }
  return 0;
}
