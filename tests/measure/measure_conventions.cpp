// Measures the time to convert light to the conventions of other engines, with and without the residual, and to rotate
// it into the world frame, by the number of discrete lights. Prints one JSON object per line for tests/figures: figure,
// value (microseconds, best of five passes), lights.
//   measure_conventions
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <numbers>

#include <lightwell/conventions.hpp>

namespace {

using namespace lightwell;

constexpr int kPasses = 5, kRepetitions = 200;

/// A typical descriptor: band 4 and small lights.
Lighting room(int lights) {
  Descriptor descriptor;
  descriptor.radiance.band = 4;
  for (int i = 0; i < descriptor.radiance.count(); ++i) {
    const float v = i == 0 ? 30 : std::sin(static_cast<float>(i));
    descriptor.radiance.c[static_cast<std::size_t>(i)] = {v, 0.9F * v, 0.8F * v};
  }
  for (int i = 0; i < lights; ++i) {
    const double angle = 2.4 * i, height = (2.0 * i + 1) / lights - 1, side = std::sqrt(1 - height * height);
    Light light;
    light.direction = vec_cast<float>(Vec3d{side * std::cos(angle), height, side * std::sin(angle)});
    light.irradiance = Irradiance{10, 9, 8} * (1.0F / static_cast<float>(i + 1));
    light.angular_radius_rad = 0.05F;
    descriptor.lights.push_back(light);
  }
  return Lighting::of(descriptor);
}

/// `work` returns a number that the compiler cannot compute in advance.
void report(const char* figure, int lights, auto&& work) {
  double best = std::numeric_limits<double>::infinity();
  volatile float sink = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kRepetitions; ++i) sink = sink + work();
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    best = std::min(best, took.count() / kRepetitions);
  }
  std::printf("{\"figure\": \"%s\", \"value\": %.2f, \"lights\": %d}\n", figure, best, lights);
}

}  // namespace

int main() {
  ConversionOptions quick;
  quick.residual = Residual::left_out;
  const ConversionOptions full;
  const Pose pose{Quat::about({0, 1, 0}, 1), {}};
  for (const int lights : {0, 1, 8, 64}) {
    const Lighting lighting = room(lights);
    report("to_arcore_us", lights,
           [&] { return to_arcore(lighting, quick).value.environmentalHdrAmbientSphericalHarmonics[0]; });
    report("to_unreal_us", lights, [&] { return to_unreal(lighting, MainLight::apart, quick).value.R[0]; });
    report("to_arcore_with_residual_us", lights, [&] { return *to_arcore(lighting, full).residual; });
    report("in_world_us", lights, [&] { return lighting.in_world(pose).irradiance({0, 1, 0}).value.r; });
  }
  return 0;
}
