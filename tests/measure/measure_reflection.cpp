// Measures PlaneReflector: time of a texture, and the error of its radiance and of the unblurred mirror image against
// the reference ray tracer; PlaneLight: time of a query, and its error against a quadrature. One JSON object per line.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/plane_light.hpp>
#include <lightwell/plane_reflection.hpp>
#include <lightwell/quantile.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "host_sdk/plane_light_quadrature.hpp"
#include "host_sdk/reflection_scenes.hpp"
#include "measure/output.hpp"
#include "measure/texture_picture.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

using test::ReflectionCase;

constexpr int kTexels = 256;
constexpr int kTriangles = 10'000;

struct NamedOptions {
  std::string name;
  ReflectionOptions options;
};

std::vector<NamedOptions> settings() {
  return {{"tolerance 1, cells of 8", {1, 8}}, {"default", {}}, {"tolerance 0.25, cells of 2", {0.25, 2}}};
}

struct Texture {
  std::vector<Radiance> reflected = std::vector<Radiance>(kTexels * kTexels);
  std::vector<float> hidden = std::vector<float>(kTexels * kTexels);
  PlaneReflection summary;
  double ms = 0;
};

void render(PlaneReflector& reflector, const ReflectionCase& test_case, Texture& out) {
  const double start = bench::thread_time_ms();
  out.summary = require(reflector.render(test_case.plane, ReflectionCase::grid(kTexels), test_case.object(),
                                         test_case.eye, out.reflected, out.hidden));
  out.ms = bench::thread_time_ms() - start;
}

double median_ms(PlaneReflector& reflector, const ReflectionCase& test_case) {
  Texture texture;
  std::vector<double> times;
  for (int k = 0; k < 15; ++k) {
    render(reflector, test_case, texture);
    times.push_back(texture.ms);
  }
  return median(times);
}

void measure_case(const ReflectionCase& test_case, const NamedOptions& setting, const bench::MemcpySpeed& copy,
                  const std::vector<test::TracedReflectionTexel>& truth) {
  PlaneReflector reflector = require(PlaneReflector::make(setting.options));
  Texture first;
  render(reflector, test_case, first);
  nlohmann::ordered_json line;
  line["scene"] = test_case.name;
  line["setting"] = setting.name;
  line["triangles"] = test_case.indices.size() / 3;
  line["texels"] = first.summary.texels;
  line["first_ms"] = first.ms;
  line["ms"] = median_ms(reflector, test_case);
  line["memcpy_ratio"] = line["ms"].get<double>() / (1e3 * copy.seconds_per_copy);
  line["memcpy_gb_s"] = copy.gigabytes_per_s;
  if (!truth.empty()) {
    const test::ReflectionErrors errors =
        test::reflection_errors(truth, ReflectionCase::grid(kTexels), first.reflected, first.hidden);
    line["rms"] = errors.rms;
    line["sharp_rms"] = errors.sharp_rms;
    line["percentile_99"] = errors.percentile_99;
    line["room_rms"] = errors.room_rms;
    line["sharp_room_rms"] = errors.sharp_room_rms;
    line["hidden_rms"] = errors.hidden_rms;
    line["sharp_hidden_rms"] = errors.sharp_hidden_rms;
  }
  measure::print_line(line);
}

/// At random points up to 0.3 m above a texture of 256 x 256 texels, with random normals.
void measure_light() {
  const CapturedPlane captured = test::plane_with_patch(256);
  const PlaneAppearance plane = test::received_plane(captured);
  PlaneLight light;
  const double start = bench::thread_time_ms();
  light.update(plane);
  nlohmann::ordered_json line;
  line["scene"] = "light of a plane";
  line["update_ms"] = bench::thread_time_ms() - start;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto diffuse = [&](Vec3d at, Vec3d) { return test::texel_green(captured, at); };
  const auto specular = [](Vec3d, Vec3d v) { return double{test::linear_specular(std::acos(v.z)).g}; };
  struct Errors {
    double squares = 0, power = 0, largest = 0;
    void add(double value, double truth) {
      squares += (value - truth) * (value - truth);
      power += truth * truth;
      largest = std::max(largest, std::abs(value - truth));
    }
  } of_diffuse, of_specular;
  std::vector<std::array<Vec3d, 2>> queries;
  constexpr int kPoints = 100;
  for (int k = 0; k < kPoints; ++k) {
    const double height = 0.01 + 0.29 * std::pow(std::abs(uniform(random)), 2);
    const Vec3d point{0.12 * uniform(random), 0.12 * uniform(random), height};
    const Vec3d normal = normalized(Vec3d{uniform(random), uniform(random), uniform(random) - 0.5});
    queries.push_back({point, normal});
    of_diffuse.add(double{light.irradiance(point, normal, PlaneLayers::diffuse).value.g},
                   test::square_irradiance(point, normal, diffuse, 512));
    of_specular.add(double{light.irradiance(point, normal, PlaneLayers::specular).value.g},
                    test::square_irradiance(point, normal, specular, 512));
  }
  line["rms"] = std::sqrt(of_diffuse.squares / of_diffuse.power);
  line["largest"] = of_diffuse.largest / std::sqrt(of_diffuse.power / kPoints);
  line["specular_rms"] = std::sqrt(of_specular.squares / of_specular.power);
  for (const auto& [name, layers] : {std::pair{"diffuse_us", PlaneLayers::diffuse}, {"both_us", PlaneLayers::all}}) {
    constexpr int kRounds = 50;
    float sum = 0;
    const double before = bench::thread_time_ms();
    for (int round = 0; round < kRounds; ++round)
      for (const auto& [point, normal] : queries) sum += light.irradiance(point, normal, layers).value.g;
    line[name] = sum > 0 ? 1e3 * (bench::thread_time_ms() - before) / (kRounds * kPoints) : 0;
  }
  measure::print_line(line);
}

/// Truth, result, and four times their difference around grey, side by side.
void draw(const ReflectionCase& test_case, int rays, const std::string& path) {
  PlaneReflector reflector = require(PlaneReflector::make({}));
  Texture texture;
  render(reflector, test_case, texture);
  const reference::ReflectionTracer tracer(test_case.scene, test_case.gloss);
  const double white = 1.5 * tracer.albedo(normalized(test_case.eye).z);
  require(measure::write_comparison(path, kTexels, 4, [&](int column, int row) {
    measure::ComparedTexel out;
    out.truth = tracer
                    .reflection(test::rectangle_of(ReflectionCase::grid(kTexels), column, row),
                                {test_case.eye.x, test_case.eye.y, test_case.eye.z}, rays)
                    .object;
    for (double& c : out.truth) c /= white;
    const Radiance& result = texture.reflected[static_cast<std::size_t>(row * kTexels + column)];
    for (int c = 0; c < 3; ++c) out.result[static_cast<std::size_t>(c)] = static_cast<double>(result[c]) / white;
    return out;
  }));
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::string picture, scene;
  bool speed = false;
  int texels = 400, rays = 2048;
  CLI::App app{"Time and error of reflections of virtual objects in a glossy plane.", "measure_reflection"};
  app.add_flag("--speed", speed, "Measure time alone");
  app.add_option("--scene", scene, "Measure only scenes whose name contains this");
  app.add_option("--texels", texels, "Texels of each texture that are compared with the ray tracer [400]")
      ->check(CLI::Range(1, kTexels * kTexels));
  app.add_option("--rays", rays, "Rays of the ray tracer for each texel [2048]")->check(CLI::Range(1, 1 << 20));
  app.add_option("--picture", picture, "Draw the first scene into this PNG: truth, result, 4 times the difference");
  app.footer("All scenes take some minutes. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    const bench::MemcpySpeed copy = bench::memcpy_speed(std::size_t{640} * 480 * 3);
    if (scene.empty() && picture.empty()) measure_light();
    for (const test::ReflectionCaseOptions& options : test::reflection_cases(kTriangles)) {
      if (options.name.find(scene) == std::string::npos) continue;
      const ReflectionCase test_case = test::make_reflection_case(options);
      if (!picture.empty()) {
        draw(test_case, rays, picture);
        return kDone;
      }
      std::vector<test::TracedReflectionTexel> truth;
      if (!speed) truth = test::trace_reflection(test_case, ReflectionCase::grid(kTexels), texels, rays);
      for (const NamedOptions& setting : settings()) measure_case(test_case, setting, copy, truth);
    }
    return kDone;
  });
}
