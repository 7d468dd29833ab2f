// Error of three balls lit by descriptors of the real panoramas, compared with balls lit by the panoramas: prints one
// JSON object per panorama, ball and kind of descriptor for tests/figures. Method: three_balls.hpp.
// - "irradiance": the default descriptor, with the bands and lights that irradiance needs
// - "as_sent": the same descriptor; instead of the reconstruction, the sum K_l c_lm Y_lm of its coefficients
// - "reflections": with an environment map of 32x32, and the lights and bands that glossy surfaces need
// - "map_64": the same with a map of 64x64
// - "map_64_caps": the same for a reader that does not know EnvironmentMap.light_texels: all lights are caps
// - "map_64_alone": the same with max_lights 0: the lights are in the map
// - "exact_64": the mirror alone, by a map of 64x64 texels that are exact means of the panorama, lights included
// Values: rmse, si_rmse, angular_deg in linear light; *_published by the protocol of the literature; si_rmse_clipped by
// clipped_si_rmse(); bytes.
// --block-edge PIXELS: blocks of the estimator (PanoramaOptions::block_edge). --panorama NAME: one panorama alone.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/cap.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/lobes.hpp>
#include <lightwell/reconstruction.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/exact_map.hpp"
#include "measure/output.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "measure/three_balls.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
namespace ref = reference;

constexpr int kViewSize = 64;
constexpr int kSmallMap = 32, kLargeMap = 64;
constexpr double kRadianceEpsilon = 0.01;
/// Minimum radius of a light in a mirror reflection: that of ar_viewer (shaders/reflectance.glsl). Pixels of both views
/// are samples in one direction, so that a larger disc would be seen where the panorama's lamp is not.
constexpr double kSmallestDiscRad = 1e-3;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_balls: %s\n", s.message().c_str());
  std::exit(1);
}

ref::Rgb rgb(const auto& v) { return {v.r, v.g, v.b}; }
Vec3f vec(const ref::V3& d) { return vec_cast<float>(Vec3d{d.x, d.y, d.z}); }

/// Radiance of the lights as discs in a mirror reflection towards `d`.
ref::Rgb discs(std::span<const Light> lights, const ref::V3& d) {
  ref::Rgb sum{};
  for (const Light& l : lights) {
    const double rho = std::max(kSmallestDiscRad, static_cast<double>(l.angular_radius_rad));
    if (ref::dot({l.direction.x, l.direction.y, l.direction.z}, d) < std::cos(rho)) continue;
    for (int c = 0; c < 3; ++c) sum[static_cast<std::size_t>(c)] += l.irradiance[c] / cap_vector_irradiance(rho);
  }
  return sum;
}

/// Radiance reflected at a roughness in a direction: by the library, and by the coefficients of the descriptor as sent.
class Reflections {
 public:
  explicit Reflections(const Lighting& light)
      : light_(light), sent_(light.descriptor().radiance), reconstruction_(reconstruct(sent_)) {}

  [[nodiscard]] ref::Rgb radiance(const ref::V3& d, double roughness) const {
    return rgb(light_.radiance(vec(d), static_cast<float>(roughness)).value);
  }

  [[nodiscard]] ref::Rgb as_sent(const ref::V3& d, double roughness) {
    if (roughness != roughness_) {
      roughness_ = roughness;
      lobe_.fill(1);
      if (roughness > 0) lobe_ = GgxLobe(roughness).coefficients();
      convolved_ = sent_;
      for (int l = 0; l <= sent_.band; ++l)
        for (int i = l * l; i < (l + 1) * (l + 1); ++i) {
          auto& c = convolved_.c[static_cast<std::size_t>(i)];
          const auto k = static_cast<float>(lobe_[static_cast<std::size_t>(l)]);
          c = {c.r * k, c.g * k, c.b * k};
        }
    }
    const ref::Rgb reconstructed = rgb(radiance_at(reconstruction_, vec(d), roughness, lobe_));
    const ref::Rgb sent = rgb(evaluate(convolved_, vec(d)));
    ref::Rgb value = radiance(d, roughness);
    for (std::size_t c = 0; c < 3; ++c) value[c] += sent[c] - reconstructed[c];
    return value;
  }

 private:
  const Lighting& light_;
  RadianceSh sent_, convolved_;
  RadianceReconstruction reconstruction_;
  double roughness_ = -1;
  std::array<double, kMaxBand + 1> lobe_{};
};

measure::Delivered deliver(const RigParameters& rig, const measure::Shot& shot, const PanoramaOptions& options) {
  auto estimator = make_panorama_estimator(rig, options);
  if (!estimator) fail(estimator.status());
  Result<measure::Delivered> delivered = measure::deliver(**estimator, shot);
  if (!delivered) fail(delivered.status());
  return std::move(*delivered);
}

/// `only`: the name of a panorama, or empty for all.
int measure_panoramas(const std::string& only, int block_edge) {
  Result<std::vector<std::string>> paths = measure::all_panoramas();
  if (!paths) fail(paths.status());
  if (!only.empty())
    std::erase_if(*paths, [&](const std::string& path) { return std::filesystem::path(path).stem() != only; });
  if (paths->empty()) fail({StatusCode::not_found, "there is no panorama " + only});
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  measure::Camera camera(rig, PixelFormat::rgb_f32);
  const measure::BallView view(kViewSize);
  for (const std::string& path : *paths) {
    const Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(path);
    if (!truth) fail(truth.status());
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    if (!panorama) fail(panorama.status());
    const sim::Scene scene(std::move(*panorama));
    const double second[] = {1};
    const measure::Shot shot = camera.expose(camera.render(scene, scene.state_at(0)), second, 0);
    const measure::BallPictures linear = measure::ball_pictures(view, truth->sums);
    const measure::BallPictures published =
        measure::ball_pictures(view, measure::PanoramaSums(measure::published_environment(truth->sums.panorama())));
    const double exposure = measure::exposure(truth->sums.panorama());

    const auto print = [&](std::string_view answer, measure::Ball ball, const measure::BallPictures& ours,
                           const measure::BallPictures& ours_published, std::size_t bytes) {
      const auto b = static_cast<std::size_t>(ball);
      const measure::BallError e = measure::ball_error(linear[b], ours[b], exposure);
      const measure::BallError p = measure::ball_error(published[b], ours_published[b], 1);
      measure::print_line({{"scene", truth->name},
                           {"ball", measure::ball_name(ball)},
                           {"answer", answer},
                           {"rmse", e.rmse},
                           {"si_rmse", e.si_rmse},
                           {"angular_deg", e.angular_deg},
                           {"truth_rms", e.truth_rms},
                           {"rmse_published", p.rmse},
                           {"si_rmse_published", p.si_rmse},
                           {"angular_deg_published", p.angular_deg},
                           {"si_rmse_clipped", measure::clipped_si_rmse(linear[b], ours[b])},
                           {"bytes", bytes}});
    };

    for (const std::string_view answer_name :
         {"irradiance", "as_sent", "reflections", "map_64", "map_64_caps", "map_64_alone"}) {
      PanoramaOptions options;
      options.block_edge = block_edge;
      EstimatorConfig& config = options.config;
      if (answer_name != "irradiance" && answer_name != "as_sent") {
        config.panorama.environment_edge = answer_name == "reflections" ? kSmallMap : kLargeMap;
        config.panorama.radiance_epsilon = kRadianceEpsilon;
        if (answer_name == "map_64_alone") config.max_lights = 0;
      }
      measure::Delivered answer = deliver(rig, shot, options);
      if (EnvironmentMap* const map = answer.descriptor.environment ? &*answer.descriptor.environment : nullptr;
          map != nullptr && answer_name == "map_64_caps") {
        map->light_tracks.clear();
        map->light_runs.clear();
        map->light_texels.clear();
      }
      const Lighting light = Lighting::of(std::move(answer.descriptor));
      Reflections reflections(light);
      const std::optional<EnvironmentView> map = light.environment();
      std::vector<Light> drawn;
      for (const Light& l : light.lights())
        if (!map || !map->shown_in_mirror(l)) drawn.push_back(l);
      const auto radiance = [&](const ref::V3& d, double roughness) {
        if (map && roughness == 0) return rgb(environment_radiance(map->mirror, vec(d), 0));
        return answer_name == "as_sent" ? reflections.as_sent(d, roughness) : reflections.radiance(d, roughness);
      };
      const measure::BallPictures ours = measure::ball_pictures(
          view, [&](const ref::V3& n) { return rgb(light.irradiance(vec(n)).value); },
          [&](const ref::V3& d, double roughness) {
            ref::Rgb v = radiance(d, roughness);
            if (roughness == 0) {
              const ref::Rgb lamps = discs(drawn, d);
              for (std::size_t c = 0; c < 3; ++c) v[c] += lamps[c];
            }
            return v;
          });
      std::vector<measure::CapLight> caps;
      for (const Light& l : drawn)
        caps.push_back({{l.direction.x, l.direction.y, l.direction.z}, l.angular_radius_rad, rgb(l.irradiance)});
      const ref::Panorama environment =
          measure::answer_environment([&](const ref::V3& d) { return radiance(d, 0); }, caps);
      const measure::BallPictures ours_published =
          measure::ball_pictures(view, measure::PanoramaSums(measure::published_environment(environment)));
      for (const measure::Ball ball : measure::kBalls) print(answer_name, ball, ours, ours_published, answer.bytes);
    }

    const measure::ExactMap exact(truth->sums.panorama(), kLargeMap);
    const auto black = [](const ref::V3&) { return ref::Rgb{}; };
    const auto mirrored = [&](const ref::V3& d, double roughness) {
      return roughness == 0 ? exact.radiance(d) : ref::Rgb{};
    };
    const ref::Panorama environment =
        measure::answer_environment([&](const ref::V3& d) { return exact.radiance(d); }, {});
    print("exact_64", measure::Ball::mirror, measure::ball_pictures(view, black, mirrored),
          measure::ball_pictures(view, measure::PanoramaSums(measure::published_environment(environment))), 0);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Three balls lit by descriptors of real panoramas, against balls lit by the panoramas.",
               "measure_balls"};
  std::string only;
  int block_edge = 0;
  app.add_option("--panorama", only, "one panorama alone, by the name of its file without extension [all]");
  app.add_option("--block-edge", block_edge, "blocks of the estimator, pixels: 1, 2, 4, 8 or 16 [chosen by it]")
      ->check(CLI::IsMember({1, 2, 4, 8, 16}));
  return run_command(app, {argv + 1, argv + argc}, [&] { return measure_panoramas(only, block_edge); });
}
