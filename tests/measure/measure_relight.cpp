// Measures relighting (lightwell/relight.hpp) against path-traced truth: equation 1 and equation 5, the simulation of
// indirect light, time of the direct part from disk. One JSON object per line.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/pixel.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/relight_capture.hpp>

#include "bench/thread_time.hpp"
#include "imaging/image_file.hpp"
#include "measure/output.hpp"
#include "measure/relight_motion.hpp"
#include "measure/relight_renders.hpp"
#include "measure/relight_stream.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

using measure::pattern_cases;
using measure::PatternCase;
using measure::RelightRenders;

/// Standard deviation of the depth that photographs come with: of 6 m half of a thousandth.
constexpr float kDepthNoise_m = 0.003F;
/// Paths of a pixel of the photographs of a subject that moves.
constexpr int kMotionSamples = 9;
/// Of the picture to look at.
constexpr double kPictureGain = 1.6;
/// A pixel is dark where the pattern's direct light is below this share of its mean over the subject.
constexpr double kDarkShare = 0.02;

std::vector<std::span<const Radiance>> spans_of(const std::vector<std::vector<Radiance>>& pictures) {
  return {pictures.begin(), pictures.end()};
}

/// Squares of differences of pictures, over the pixels of the subject.
double rmse(const RelightRenders& renders, std::span<const Radiance> a, std::span<const Radiance> b,
            const std::vector<bool>& counts) {
  double squares = 0, values = 0;
  for (std::size_t p = 0; p < renders.pixels(); ++p) {
    if (!counts[p]) continue;
    for (int c = 0; c < 3; ++c) squares += std::pow(static_cast<double>(a[p][c]) - static_cast<double>(b[p][c]), 2);
    values += 3;
  }
  return std::sqrt(squares / std::max(values, 1.0));
}

std::vector<bool> subject_pixels(const RelightRenders& renders) {
  std::vector<bool> out(renders.pixels());
  for (std::size_t p = 0; p < out.size(); ++p) out[p] = renders.is_subject(p);
  return out;
}

/// Those of the subject that the pattern does not reach.
std::vector<bool> dark_pixels(const RelightRenders& renders, std::size_t scene) {
  std::vector<bool> out = subject_pixels(renders);
  const auto& direct = renders.truth_direct[scene];
  double sum = 0;
  const auto count = static_cast<double>(std::ranges::count(out, true));
  for (std::size_t p = 0; p < out.size(); ++p)
    if (out[p]) sum += static_cast<double>(direct[p].luminance());
  for (std::size_t p = 0; p < out.size(); ++p)
    out[p] = out[p] && static_cast<double>(direct[p].luminance()) < kDarkShare * sum / count;
  return out;
}

struct Relit {
  std::vector<Radiance> direct, corrected, one_bounce;
};

Relit relit(const RelightRenders& renders, const RelightSubject& subject, const PatternCase& scene) {
  const auto basis = measure::basis_lights();
  std::vector<RgbFactor> picture;
  const std::array patterns = {measure::pattern_light(scene, picture)};
  AlphaMaps alpha;
  (void)require(alpha.compute(subject, basis, patterns, {}));
  Relit out;
  out.direct.resize(renders.pixels());
  out.corrected = out.one_bounce = out.direct;
  const auto photographs = spans_of(renders.photographs);
  require(relight_direct(alpha, photographs, out.direct));
  IndirectOptions options;
  require(relight_corrected(alpha, photographs, require(simulate_indirect(subject, basis, patterns, alpha, options)),
                            out.corrected));
  options.bounces = 1;
  require(relight_corrected(alpha, photographs, require(simulate_indirect(subject, basis, patterns, alpha, options)),
                            out.one_bounce));
  return out;
}

void measure_accuracy(const RelightRenders& renders, const RelightSubject& subject, const std::string& inputs) {
  for (std::size_t s = 0; s < pattern_cases().size(); ++s) {
    const PatternCase& scene = pattern_cases()[s];
    const Relit result = relit(renders, subject, scene);
    const std::vector<bool> all = subject_pixels(renders), dark = dark_pixels(renders, s);
    const auto error = [&](const std::vector<Radiance>& picture, const std::vector<bool>& counts) {
      return rmse(renders, picture, renders.truth[s], counts);
    };
    nlohmann::ordered_json line;
    line["part"] = "accuracy";
    line["scene"] = scene.name;
    line["inputs"] = inputs;
    line["lit_from"] = "one projector";
    line["rmse_direct"] = error(result.direct, all);
    line["rmse_corrected"] = error(result.corrected, all);
    line["rmse_one_bounce"] = error(result.one_bounce, all);
    line["dark_direct"] = error(result.direct, dark);
    line["dark_corrected"] = error(result.corrected, dark);
    line["dark_share"] =
        static_cast<double>(std::ranges::count(dark, true)) / static_cast<double>(std::ranges::count(all, true));
    measure::print_line(line);
  }
}

/// With all triangles of the subject.
RelightSubject whole_subject(const RelightRenders& renders) {
  const reference::TracedMesh mesh = reference::traced_figurine();
  std::vector<Vec3f> vertices;
  for (const reference::V3& v : mesh.positions) vertices.push_back(vec_cast<float>(Vec3d{v.x, v.y, v.z}));
  std::vector<std::uint32_t> indices;
  for (const auto& triangle : mesh.triangles) indices.insert(indices.end(), triangle.begin(), triangle.end());
  return require(RelightSubject::from_mesh(renders.camera, {vertices, indices}, {renders.albedo, renders.normals}));
}

/// From photographs and noisy depth alone: normals, then depth refined by them, then normals and albedo without the
/// indirect light of this surface.
RelightSubject photographed_subject(const RelightRenders& renders) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, kDepthNoise_m);
  std::vector<float> depth = renders.depth_m;
  for (float& d : depth)
    if (d > 0) d += noise(random);
  const auto basis = measure::basis_lights();
  const auto photographs = spans_of(renders.photographs);
  PhotometricStereoOptions options;
  options.interreflection_rounds = 0;
  const RelightSubject noisy = require(RelightSubject::from_depth(renders.camera, depth, {}));
  const auto first = require(estimate_surface(noisy, basis, photographs, options));
  const RelightSubject refined =
      require(RelightSubject::from_depth(renders.camera, require(refine_depth(noisy, first.normals)), {}));
  const auto surface = require(estimate_surface(refined, basis, photographs));
  return require(refined.with({surface.albedo, surface.normals}));
}

/// For each pattern a row: a photograph under the basis light nearest to it, equation 1, equation 5, truth.
Status write_picture(const RelightRenders& renders, const RelightSubject& subject, const std::string& path) {
  const auto columns = static_cast<std::size_t>(renders.camera.columns),
             rows = static_cast<std::size_t>(renders.camera.rows);
  const std::size_t cases = 2;
  Image out{static_cast<int>(4 * columns), static_cast<int>(cases * rows), PixelFormat::rgb8,
            std::vector<std::byte>(cases * 12 * columns * rows)};
  const auto basis = measure::basis_lights();
  for (std::size_t s = 0; s < cases; ++s) {
    const reference::V3& place = pattern_cases()[s].light.position;
    const Vec3d at{place.x, place.y, place.z};
    const auto nearest = std::ranges::min_element(basis, {}, [&](const BasisLight& b) { return length(b.place - at); });
    const Relit result = relit(renders, subject, pattern_cases()[s]);
    const std::array<std::span<const Radiance>, 4> pictures = {
        renders.photographs[static_cast<std::size_t>(nearest - basis.begin())], result.direct, result.corrected,
        renders.truth[s]};
    for (std::size_t k = 0; k < pictures.size(); ++k)
      for (std::size_t p = 0; p < renders.pixels(); ++p)
        for (int c = 0; c < 3; ++c)
          out.data[3 * ((s * rows + p / columns) * 4 * columns + k * columns + p % columns) +
                   static_cast<std::size_t>(c)] =
              static_cast<std::byte>(std::lround(
                  255 * linear_to_srgb(std::clamp(kPictureGain * static_cast<double>(pictures[k][p][c]), 0.0, 1.0))));
  }
  return write_png(path, out);
}

/// I_spatial of the first scene against the truth.
void measure_indirect(const RelightRenders& renders, const RelightSubject& subject) {
  const PatternCase& scene = pattern_cases()[0];
  const auto basis = measure::basis_lights();
  std::vector<RgbFactor> picture;
  const std::array patterns = {measure::pattern_light(scene, picture)};
  AlphaMaps alpha;
  (void)require(alpha.compute(subject, basis, patterns, {}));
  std::vector<Radiance> truth(renders.pixels());
  for (std::size_t p = 0; p < truth.size(); ++p) truth[p] = renders.truth[0][p] - renders.truth_direct[0][p];
  const std::vector<bool> all = subject_pixels(renders);
  const double size = rmse(renders, truth, std::vector<Radiance>(truth.size()), all);
  for (const auto& [samples, bounces, step] : {std::array{16, 1, 2},
                                               {16, 3, 2},
                                               {64, 1, 1},
                                               {64, 1, 2},
                                               {64, 3, 2},
                                               {64, 8, 2},
                                               {64, 3, 4},
                                               {256, 3, 2},
                                               {256, 3, 1},
                                               {1024, 8, 1}}) {
    IndirectOptions options;
    options.samples = samples;
    options.bounces = bounces;
    options.step = step;
    const double start = bench::thread_time_ms();
    const IndirectLight light = require(simulate_indirect(subject, basis, patterns, alpha, options));
    nlohmann::ordered_json line;
    line["part"] = "indirect";
    line["scene"] = scene.name;
    line["samples"] = samples;
    line["bounces"] = bounces;
    line["step"] = step;
    line["lights"] = 2;
    line["ms"] = bench::thread_time_ms() - start;
    line["simulated"] = light.simulated_pixels;
    line["error"] = rmse(renders, light.spatial, truth, all) / size;
    measure::print_line(line);
  }
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::string folder, picture;
  std::vector<std::string> parts;
  measure::RelightRenderSize size;
  CLI::App app{"Relighting: equations 1 and 5 against path-traced truth, indirect light, time from disk.",
               "measure_relight"};
  app.add_option("--renders", folder, "Folder in which renders are kept; without it each run renders them");
  app.add_option("--columns", size.columns, "Columns of the pictures, which are 4:3 [320]")
      ->check(CLI::Range(16, 1600));
  app.add_option("--samples", size.basis_samples,
                 "Paths of a pixel of a photograph; of the truth four times as many [100]")
      ->check(CLI::Range(1, 10000));
  app.add_option("--picture", picture, "PNG of photograph, equation 1, equation 5 and truth");
  app.add_option("--part", parts, "accuracy, indirect, motion or stream; may be repeated [all]")
      ->check(CLI::IsMember({"accuracy", "indirect", "motion", "stream"}));
  app.footer("Rendering takes minutes on two cores. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    const auto wanted = [&](const char* part) {
      return parts.empty() || std::ranges::find(parts, part) != parts.end();
    };
    size.rows = size.columns * 3 / 4;
    size.truth_samples = 4 * size.basis_samples;
    const RelightRenders renders = require(measure::relight_renders(size, folder));
    const RelightSubject whole = whole_subject(renders);
    const RelightSubject exact =
        require(RelightSubject::from_depth(renders.camera, renders.depth_m, {renders.albedo, renders.normals}));
    if (wanted("accuracy")) {
      measure_accuracy(renders, whole, "mesh");
      measure_accuracy(renders, exact, "exact");
      measure_accuracy(renders, photographed_subject(renders), "photographs");
    }
    if (!picture.empty()) require(write_picture(renders, whole, picture));
    if (wanted("indirect")) measure_indirect(renders, whole);
    if (wanted("motion")) measure::measure_relight_motion(size.columns, kMotionSamples);
    if (wanted("stream")) measure::measure_relight_stream(folder);
    return kDone;
  });
}
