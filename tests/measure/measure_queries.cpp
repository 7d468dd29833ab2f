// Times of the SDK's queries: one JSON object per line for tests/figures (figure, value, memcpy_gb_per_s: of this run;
// vector: vector unit of the batch queries). Best of five repeats of a long loop each, one thread.
//   measure_queries [--vector best|avx2|sse4]
//     latest_ns                      Probe::latest(), with a recording as source
//     irradiance_ns.bandL.N          one normal, N lights, over normals of the whole sphere
//     normals_per_s.bandL.N          batches in arrays larger than a core's caches, in millions
//     radiance_ns, at_ns, rotated_ns the same for the other queries
//     cube_map_ms.FROM.N             a cube map of edge 64, RGBA16F, from the environment map or the harmonics, N
//     lights
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <unistd.h>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/cube_map.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/recording.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/vector_unit.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

double memcpy_gb_per_s = 0;
std::string vector_unit;

void print(const std::string& figure, double value) {
  measure::print_line(
      {{"figure", figure}, {"value", value}, {"memcpy_gb_per_s", memcpy_gb_per_s}, {"vector", vector_unit}});
}

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "measure_queries: %s\n", what.c_str());
  std::exit(1);
}

/// Seconds per call: the best of five repeats of `calls` calls.
template <class Work>
double seconds_of_one(int calls, Work&& work) {
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) work(static_cast<std::size_t>(i));
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / calls);
  }
  return best;
}

volatile float kept;  ///< Keeps the compiler from removing the computation.

std::vector<Vec3f> normals_all_over(std::size_t count) {
  std::vector<Vec3f> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double y = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count), s = std::sqrt(1 - y * y);
    // In random order: neighbours on the sphere would make branches predictable.
    const double phi = static_cast<double>(i * 7919 % count) * std::numbers::pi * (3 - std::sqrt(5.0));
    out.push_back(vec_cast<float>(Vec3d{s * std::cos(phi), y, s * std::sin(phi)}));
  }
  return out;
}

/// A synthetic descriptor; its lights, if any, are the sun and lamps of three degrees.
Descriptor scene(int band, int lights) {
  Descriptor d;
  d.radiance.band = band;
  for (int i = 0; i < sh_count(band); ++i) {
    const float v = i == 0 ? 3 : 0.3F * std::sin(static_cast<float>(i));
    d.radiance.c[static_cast<std::size_t>(i)] = {v, 0.9F * v, 0.8F * v};
  }
  for (int i = 0; i < lights; ++i) {
    Light light;
    light.direction = normalized(Vec3f{0.3F - static_cast<float>(i), 0.8F, 0.2F * static_cast<float>(i)});
    light.irradiance = {4, 3, 2};
    light.angular_radius_rad = i == 0 ? 0.0047F : 0.026F;
    light.track = static_cast<std::uint32_t>(i + 1);
    d.lights.push_back(light);
  }
  return d;
}

void one_normal(int band, int lights) {
  const Lighting lighting = Lighting::of(scene(band, lights));
  const std::vector<Vec3f> normals = normals_all_over(4096);
  float sum = 0;
  const double s =
      seconds_of_one(2'000'000, [&](std::size_t i) { sum += lighting.irradiance(normals[i % 4096]).value.r; });
  kept = sum;
  print("irradiance_ns.band" + std::to_string(band) + "." + std::to_string(lights), 1e9 * s);
}

void many_normals(int band, int lights) {
  const Lighting lighting = Lighting::of(scene(band, lights));
  const std::vector<Vec3f> normals = normals_all_over(1 << 20);
  std::vector<Irradiance> out(normals.size());
  const double s =
      seconds_of_one(20, [&](std::size_t) { kept = static_cast<float>(lighting.irradiance(normals, out).value); });
  kept = out[17].r;
  print("normals_per_s.band" + std::to_string(band) + "." + std::to_string(lights),
        1e-6 * static_cast<double>(normals.size()) / s);
}

/// 64 descriptors, 16 ms apart.
std::string recording() {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("measure_queries_" + std::to_string(::getpid()))).string();
  Result<RecordWriter> writer = RecordWriter::open(path, {RecordingKind::descriptors, "measured", "0", {}});
  if (!writer) fail(writer.status().message());
  Encoder encoder;
  for (std::uint64_t i = 1; i <= 64; ++i) {
    Descriptor d = scene(4, 2);
    d.sequence = i;
    d.time.mid_exposure.ns = static_cast<std::int64_t>(i) * 16'000'000;
    d.time.encoded_after = {1'000'000};
    const auto bytes = encoder.encode(d);
    if (!bytes) fail(bytes.status().message());
    if (const Status s = writer->append(d.time.mid_exposure.ns, *bytes); !s.ok()) fail(s.message());
  }
  if (const Status s = writer->flush(); !s.ok()) fail(s.message());
  return path;
}

void probe() {
  const std::string path = recording();
  Result<Probe> probe = Probe::connect("replay:" + path + "?speed=0");
  if (!probe) fail(probe.status().message());
  while (probe->stats().state != LinkState::ended) ::usleep(1000);
  double age = 0;
  print("latest_ns", 1e9 * seconds_of_one(2'000'000, [&](std::size_t) { age += probe->latest().age().seconds(); }));
  const HostTime newest = probe->latest().mid_exposure();
  print("at_ns",
        1e9 * seconds_of_one(200'000, [&](std::size_t i) {
          age += probe->at({newest.ns - 8'000'000 - static_cast<std::int64_t>(i % 900) * 1'000'000}).age().seconds();
        }));
  kept = static_cast<float>(age);
  std::filesystem::remove(path);
}

void others() {
  const Lighting lighting = Lighting::of(scene(4, 2));
  const std::vector<Vec3f> normals = normals_all_over(4096);
  float sum = 0;
  print("radiance_ns", 1e9 * seconds_of_one(200'000, [&](std::size_t i) {
                         sum += lighting.radiance(normals[i % 4096], 0.5F).value.r;
                       }));
  print("rotated_ns",
        1e9 * seconds_of_one(20'000, [&](std::size_t i) {
          sum += lighting.rotated(Quat::about({0, 1, 0}, 1e-3 * static_cast<double>(i))).irradiance({0, 1, 0}).value.r;
        }));
  kept = sum;
}

/// A level of 64 x 64 texels, the finest that a map can have.
EnvironmentMap environment_map() {
  EnvironmentMap map;
  map.levels = {{64, 0}, {8, 1}};
  map.key_interval_ms = 1000;
  for (std::uint32_t i = 0; i < texel_count(map.levels); ++i)
    map.texels.push_back(rgb9e5_encode(static_cast<float>(i % 7), 2, static_cast<float>(i % 5)));
  map.key = environment_key(map);
  return map;
}

void cube_maps() {
  std::vector<std::byte> texels(cube_map_bytes(kMaxCubeEdge, CubeFormat::rgba16f));
  for (const bool with_map : {false, true})
    for (const int lights : {0, 8}) {
      Descriptor d = scene(4, lights);
      if (with_map) d.environment = environment_map();
      const Lighting lighting = Lighting::of(std::move(d));
      const double s = seconds_of_one(20, [&](std::size_t) { (void)cube_map(lighting, {}, texels); });
      print(std::string("cube_map_ms.") + (with_map ? "map." : "harmonics.") + std::to_string(lights), 1e3 * s);
    }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Times of the SDK's queries.", "measure_queries"};
  std::string vector = "best";
  app.add_option("--vector", vector, "best, avx2 or sse4: largest vector unit of the kernels [best]");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  Result<std::string> unit = bench::select_vector_unit(vector);
  if (!unit) return wrong_usage(app, unit.status().message());
  vector_unit = std::move(*unit);
  memcpy_gb_per_s = bench::memcpy_speed(4 << 20).gigabytes_per_s;
  probe();
  for (const int band : {2, 4, 6})
    for (const int lights : {0, 2, 8}) one_normal(band, lights), many_normals(band, lights);
  others();
  cube_maps();
}
