// Measures PlaneReflector: time of a texture, and the error of its radiance and of the unblurred mirror image against
// the reference ray tracer. One JSON object per line.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/plane_reflection.hpp>
#include <lightwell/quantile.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "host_sdk/reflection_scenes.hpp"
#include "imaging/image_file.hpp"
#include "measure/output.hpp"
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
    line["hidden_rms"] = errors.hidden_rms;
    line["sharp_hidden_rms"] = errors.sharp_hidden_rms;
  }
  measure::print_line(line);
}

/// Truth, result, and four times their difference around grey, side by side.
void draw(const ReflectionCase& test_case, int rays, const std::string& path) {
  PlaneReflector reflector = require(PlaneReflector::make({}));
  Texture texture;
  render(reflector, test_case, texture);
  const reference::ReflectionTracer tracer(test_case.scene, test_case.gloss);
  Image picture{3 * kTexels, kTexels, PixelFormat::rgb8, std::vector<std::byte>(9UL * kTexels * kTexels)};
  const double white = 1.5 * tracer.albedo(normalized(test_case.eye).z);
  const auto set = [&](int column, int row, int channel, double value) {
    const double code = 255 * std::pow(std::clamp(value, 0.0, 1.0), 1 / 2.2) + 0.5;
    picture.data[static_cast<std::size_t>((row * 3 * kTexels + column) * 3 + channel)] = static_cast<std::byte>(code);
  };
  for (int row = 0; row < kTexels; ++row)
    for (int column = 0; column < kTexels; ++column) {
      const auto truth = tracer.reflection(test::rectangle_of(ReflectionCase::grid(kTexels), column, row),
                                           {test_case.eye.x, test_case.eye.y, test_case.eye.z}, rays);
      for (int c = 0; c < 3; ++c) {
        const double got = texture.reflected[static_cast<std::size_t>(row * kTexels + column)][c] / white;
        const double exact = truth.object[static_cast<std::size_t>(c)] / white;
        set(column, row, c, exact);
        set(kTexels + column, row, c, got);
        set(2 * kTexels + column, row, c, 0.5 + 4 * (got - exact));
      }
    }
  require(write_png(path, picture));
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
