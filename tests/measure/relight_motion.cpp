#include "measure/relight_motion.hpp"

#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/relight.hpp>
#include <lightwell/relight_align.hpp>

#include "bench/thread_time.hpp"
#include "measure/output.hpp"
#include "measure/relight_renders.hpp"
#include "tools/command_line.hpp"

namespace lightwell::measure {
namespace {

using reference::PathTracer;
using reference::TracedCamera;
using reference::TracedLight;
using Picture = std::vector<Radiance>;

constexpr double kEye_m = 6, kHalfWidth_m = 1.45;
/// Of the distant light, as weight of each basis light, beside blinds at a basis light.
constexpr float kWeight = 0.05F;
/// Displacement of the subject in a cycle: as a head that turns or walks, and as a fast gesture, at 24 cycles a second.
constexpr double kSpeeds_px[] = {4, 16};

/// The subject at `x` m from its place: camera and lights move the other way.
struct Shot {
  TracedCamera camera;
  std::vector<TracedLight> lights;

  Shot(int columns, double x, std::vector<TracedLight> at) : lights(std::move(at)) {
    camera = {columns, columns * 3 / 4, 0.5 * columns * kEye_m / kHalfWidth_m, {-x, 0, kEye_m}};
    for (TracedLight& light : lights) light.position.x -= x;
  }
};

/// The sum over the lights.
Picture photograph(const reference::TracedPictures& traced) {
  Picture out(traced.coverage.size());
  for (const auto& light : traced.light)
    for (std::size_t p = 0; p < out.size(); ++p) out[p] += {light[p][0], light[p][1], light[p][2]};
  return out;
}

struct Cycle {
  std::vector<Picture> photographs;   ///< Between the tracking frames, at equal intervals.
  Picture first, second;              ///< Under all basis lights.
  reference::TracedPictures subject;  ///< At the first tracking frame.
};

double time_of(std::size_t photograph) { return static_cast<double>(photograph + 1) / (kBasisLights + 1); }

/// The subject moves by `shift_m` between the tracking frames.
Cycle render(const PathTracer& tracer, int columns, int samples, double shift_m, std::uint32_t seed) {
  const auto basis = traced_basis();
  const auto trace = [&](double time, const std::vector<TracedLight>& lights, std::uint32_t offset) {
    const Shot shot(columns, shift_m * time, lights);
    return tracer.trace(shot.camera, shot.lights, {samples, 16, seed + offset, 2});
  };
  Cycle out;
  out.subject = trace(0, basis, 0);
  out.first = photograph(out.subject);
  out.second = photograph(trace(1, basis, 1));
  for (std::size_t i = 0; i < basis.size(); ++i)
    out.photographs.push_back(photograph(trace(time_of(i), {basis[i]}, static_cast<std::uint32_t>(2 + i))));
  return out;
}

std::vector<Picture> aligned(const Cycle& cycle, int columns) {
  std::vector<TimedPhotograph> photographs;
  for (std::size_t i = 0; i < cycle.photographs.size(); ++i) photographs.push_back({time_of(i), cycle.photographs[i]});
  std::vector<Picture> out;
  (void)require(align_photographs(columns, columns * 3 / 4, {0, cycle.first}, {1, cycle.second}, photographs, out));
  return out;
}

Picture relit(const AlphaMaps& alpha, const std::vector<Picture>& photographs) {
  Picture out(photographs[0].size());
  const std::vector<std::span<const Radiance>> basis(photographs.begin(), photographs.end());
  require(relight_direct(alpha, basis, out));
  return out;
}

double rmse(const reference::TracedPictures& subject, const Picture& a, const Picture& b) {
  double squares = 0, values = 0;
  for (std::size_t p = 0; p < a.size(); ++p) {
    if (!(subject.coverage[p] > 0.999F)) continue;
    for (int c = 0; c < 3; ++c) squares += std::pow(static_cast<double>(a[p][c] - b[p][c]), 2);
    values += 3;
  }
  return std::sqrt(squares / values);
}

}  // namespace

void measure_relight_motion(int columns, int samples) {
  const PathTracer tracer(reference::traced_figurine());
  const Cycle still = render(tracer, columns, samples, 0, 1000);
  RelightCamera camera{columns,       columns * 3 / 4, 0.5 * columns * kEye_m / kHalfWidth_m,
                       0.5 * columns, 0.375 * columns, {}};
  camera.T_world_camera.translation = {0, 0, kEye_m};
  const RelightSubject subject = require(RelightSubject::from_depth(camera, still.subject.depth, {}));
  std::vector<RgbFactor> picture;
  const std::vector<PatternLight> patterns = {pattern_light(pattern_cases()[0], picture)};
  AlphaMaps alpha;
  (void)require(alpha.compute(subject, basis_lights(), patterns,
                              std::vector<RgbFactor>(kBasisLights, RgbFactor{kWeight, kWeight, kWeight})));
  const Picture truth = relit(alpha, still.photographs);
  for (const double speed_px : kSpeeds_px) {
    const Cycle cycle = render(tracer, columns, samples, speed_px * kEye_m / camera.focal_px, 2000);
    const double start = bench::thread_time_ms();
    const std::vector<Picture> moved_back = aligned(cycle, columns);
    nlohmann::ordered_json line;
    line["part"] = "motion";
    line["px_per_cycle"] = speed_px;
    line["ms"] = bench::thread_time_ms() - start;
    line["unaligned"] = rmse(still.subject, relit(alpha, cycle.photographs), truth);
    line["aligned"] = rmse(still.subject, relit(alpha, moved_back), truth);
    print_line(line);
  }
}

}  // namespace lightwell::measure
