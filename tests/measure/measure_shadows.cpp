// Measures ShadowCaster: time of a texture, and the error of its ratios against the reference ray tracer at several
// settings. One JSON object per line.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/shadows.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "host_sdk/shadow_scenes.hpp"
#include "measure/output.hpp"
#include "measure/texture_picture.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

using test::ShadowCase;

constexpr int kTexels = 256;
constexpr int kTriangles = 10'000;

struct NamedOptions {
  std::string name;
  ShadowOptions options;
};

std::vector<NamedOptions> settings() {
  return {{"8 samples, 32 directions, cells of 4", {8, 32, 4}},
          {"16 samples, 48 directions, cells of 2", {16, 48, 2}},
          {"32 samples, 64 directions, cells of 2", {32, 64, 2}},
          {"32 samples, 64 directions, cells of 1", {32, 64, 1}},
          {"default", {}},
          {"64 samples, 128 directions, cells of 1", {64, 128, 1}},
          {"256 samples, 512 directions, cells of 1", {256, 512, 1}}};
}

struct Texture {
  std::vector<LightRatio> ratios = std::vector<LightRatio>(kTexels * kTexels);
  ShadowSummary summary;
  double ms = 0;
};

void cast(ShadowCaster& caster, const ShadowCase& shadow_case, Texture& out) {
  const ShadowReceiver receiver = shadow_case.receiver(kTexels);
  const double start = bench::thread_time_ms();
  out.summary = require(caster.cast(shadow_case.lighting, receiver, shadow_case.mesh(), out.ratios)).value;
  out.ms = bench::thread_time_ms() - start;
}

double median_ms(ShadowCaster& caster, const ShadowCase& shadow_case) {
  Texture texture;
  std::vector<double> times;
  for (int k = 0; k < 30; ++k) {
    cast(caster, shadow_case, texture);
    times.push_back(texture.ms);
  }
  return median(times);
}

/// cv::warpPerspective of a picture of 640x480 to the size of the texture, one thread.
double warp_perspective_ms() {
  cv::setNumThreads(1);
  const cv::Mat picture(480, 640, CV_8UC3, cv::Scalar(10, 20, 30));
  cv::Mat rectified;
  const cv::Point2f from[] = {{80, 60}, {560, 60}, {600, 420}, {40, 420}},
                    to[] = {{0, 0}, {256, 0}, {256, 256}, {0, 256}};
  const cv::Mat homography = cv::getPerspectiveTransform(from, to);
  std::vector<double> times;
  for (int k = 0; k < 50; ++k) {
    const double start = bench::thread_time_ms();
    cv::warpPerspective(picture, rectified, homography, {kTexels, kTexels});
    times.push_back(bench::thread_time_ms() - start);
  }
  return median(times);
}

void measure_case(const ShadowCase& shadow_case, const NamedOptions& setting, const bench::MemcpySpeed& copy,
                  double warp_ms, const std::vector<test::TracedTexel>& truth) {
  ShadowCaster caster = require(ShadowCaster::make(setting.options));
  Texture first;
  cast(caster, shadow_case, first);
  nlohmann::ordered_json line;
  line["scene"] = shadow_case.name;
  line["setting"] = setting.name;
  line["triangles"] = shadow_case.indices.size() / 3;
  line["directions"] = first.summary.directions;
  line["first_ms"] = first.ms;
  line["ms"] = median_ms(caster, shadow_case);
  line["memcpy_ratio"] = line["ms"].get<double>() / (1e3 * copy.seconds_per_copy);
  line["warp_perspective_ratio"] = line["ms"].get<double>() / warp_ms;
  line["memcpy_gb_s"] = copy.gigabytes_per_s;
  if (!truth.empty()) {
    const test::ShadowErrors errors = test::shadow_errors(truth, shadow_case.receiver(kTexels), first.ratios);
    line["rms"] = errors.rms;
    line["rms_shadowed"] = errors.rms_shadowed;
    line["percentile_99"] = errors.percentile_99;
    line["largest"] = errors.largest;
  }
  measure::print_line(line);
}

/// Truth, result, and eight times their difference around grey, side by side.
void draw(const ShadowCase& shadow_case, const ShadowOptions& options, int rays, const std::string& path) {
  ShadowCaster caster = require(ShadowCaster::make(options));
  Texture texture;
  cast(caster, shadow_case, texture);
  const reference::ShadowTracer tracer(shadow_case.scene);
  const ShadowReceiver receiver = shadow_case.receiver(kTexels);
  require(measure::write_comparison(path, kTexels, 8, [&](int column, int row) {
    measure::ComparedTexel out{tracer.ratio(test::rectangle_of(receiver, column, row), rays)};
    for (int c = 0; c < 3; ++c)
      out.result[static_cast<std::size_t>(c)] = texture.ratios[static_cast<std::size_t>(row * kTexels + column)][c];
    return out;
  }));
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::string picture, scene;
  bool speed = false;
  int texels = 1500, rays = 1024;
  CLI::App app{"Time and error of the shadows that virtual objects cast on a plane.", "measure_shadows"};
  app.add_flag("--speed", speed, "Measure time alone");
  app.add_option("--scene", scene, "Measure only scenes whose name contains this");
  app.add_option("--texels", texels, "Texels of each texture that are compared with the ray tracer [1500]")
      ->check(CLI::Range(1, kTexels * kTexels));
  app.add_option("--rays", rays, "Rays of the ray tracer for each texel and light [1024]")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--picture", picture, "Draw the first scene into this PNG: truth, result, 8 times the difference");
  app.footer("All scenes take some minutes. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    const bench::MemcpySpeed copy = bench::memcpy_speed(std::size_t{640} * 480 * 3);
    const double warp_ms = warp_perspective_ms();
    std::vector<test::ShadowCaseOptions> cases = test::shadow_cases(kTriangles);
    cases.push_back(test::unconnected_case(kTriangles));
    for (const test::ShadowCaseOptions& options : cases) {
      if (options.name.find(scene) == std::string::npos) continue;
      const ShadowCase shadow_case = test::make_shadow_case(options);
      if (!picture.empty()) {
        draw(shadow_case, {}, rays, picture);
        return kDone;
      }
      std::vector<test::TracedTexel> truth;
      if (!speed) truth = test::trace_texels(shadow_case, shadow_case.receiver(kTexels), texels, rays);
      for (const NamedOptions& setting : settings()) measure_case(shadow_case, setting, copy, warp_ms, truth);
    }
    return kDone;
  });
}
