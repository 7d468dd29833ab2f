// Measures captured planes on the wire and in the SDK: bytes of messages, and times (best of five passes) to encode,
// receive, render and query, by the levels of the lumisphere. Prints one JSON object per line for tests/figures.
//   measure_planes
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>
#include <vector>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>

#include "measure/output.hpp"
#include "support/captured_planes.hpp"

namespace {

using namespace lightwell;

constexpr int kPasses = 5;

/// `work` returns a number that the compiler cannot compute in advance.
double best_us(int repetitions, auto&& work) {
  double best = std::numeric_limits<double>::infinity();
  volatile float sink = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < repetitions; ++i) sink = sink + work(i);
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    best = std::min(best, took.count() / repetitions);
  }
  return best;
}

double total_bytes(std::span<const std::vector<std::byte>> messages) {
  std::size_t out = 0;
  for (const auto& m : messages) out += m.size();
  return static_cast<double>(out);
}

void measure_levels(int levels) {
  const auto print = [&](const char* figure, double value) {
    measure::print_figure(figure, value, {{"levels", levels}});
  };
  CapturedPlane plane = test::linear_plane(256, levels, 60);
  PlaneEncoder without, encoder({.images = ImageRecipients::all_clients});
  print("whole_without_texture_bytes", total_bytes(*without.encode(plane, plane.info.mid_exposure)));
  print("whole_bytes", total_bytes(*encoder.encode(plane, plane.info.mid_exposure)));
  print("unchanged_bytes", total_bytes(*encoder.encode(plane, plane.info.mid_exposure)));
  print("encode_unchanged_us",
        best_us(20, [&](int) { return static_cast<float>(encoder.encode(plane, plane.info.mid_exposure)->size()); }));
  // Each pass changes every texel and node by more than the step.
  print("encode_all_us", best_us(20, [&](int i) {
          const float factor = i % 2 == 0 ? 1.25F : 0.8F;
          for (auto* list : {&plane.texture.radiance, &plane.lumisphere.radiance})
            for (Radiance& v : *list) v = v * factor;
          return static_cast<float>(encoder.encode(plane, plane.info.mid_exposure)->size());
        }));
  const auto whole = encoder.whole();
  print("receive_whole_us", best_us(10, [&](int) {
          PlaneReader reader;
          for (const auto& m : whole) (void)reader.take(m, {});
          return static_cast<float>(reader.snapshot({}).revision());
        }));
  PlaneReader reader;
  for (const auto& m : whole) (void)reader.take(m, {});
  const PlaneAppearance now = reader.snapshot({});
  // The plane fills the picture.
  const PlaneCamera camera{640, 480, 900, 900, 319.5, 239.5, {Quat::about({1, 0, 0}, 0.6), {0, -0.14, 0.2}}};
  std::vector<float> rgb(std::size_t{3} * 640 * 480);
  std::size_t pixels = 1;
  const double render_us = best_us(5, [&](int) {
    pixels = now.render(camera, PlaneLayers::all, rgb).pixels;
    return rgb[3 * (240 * 640 + 320)];
  });
  print("render_ns_per_pixel", 1e3 * render_us / static_cast<double>(std::max<std::size_t>(pixels, 1)));
  print("render_pixels", static_cast<double>(pixels));
  print("radiance_ns", 1e3 * best_us(20'000, [&](int i) {
                         const double x = 1e-6 * (i % 90'000);
                         return now.radiance({x, -x}, {0.3 - 3 * x, 0.1, 0.4}).value.r;
                       }));
  PlaneCoverage coverage = plane.coverage;
  coverage.grid = HemisphereGrid(levels);
  coverage.seen.assign(coverage.grid.size(), 0);
  for (std::size_t n = 0; n < coverage.seen.size(); ++n) coverage.seen[n] = coverage.grid.direction(n).x > 0.3 ? 1 : 0;
  print("guidance_us", best_us(10, [&](int) { return static_cast<float>(plane_guidance(coverage).gap_rad); }));
}

}  // namespace

int main() {
  for (const int levels : {60, 120}) measure_levels(levels);
  return 0;
}
