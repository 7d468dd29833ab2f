// Measures the panorama estimator's time from frame to encoded descriptor, and of memcpy of the same bytes in the same
// run. Prints one JSON object per line for tests/figures: figure, value (time relative to memcpy), ms, memcpy_gb_per_s,
// bytes (of the descriptor), lights, vector (vector unit of the kernels), and further members named below.
//   measure_speed formats    SETTING.RIG.FORMAT     one image
//   measure_speed brackets   bracket.RIG.FORMAT     three exposures at `balanced`
//   measure_speed sizes      size.SETTING.WxH       one lens; seen_pixels: pixels in the lens's field; the others cost
//                                                   nothing
//   measure_speed lights     lights.CHOICE.SETTING.FORMAT.N  N small lights in a uniform room. CHOICE:
//                            as_rich_as_needed: the default of 1 %; all_sent: epsilon 0, 64 lights in the descriptor
//   measure_speed unit       unit: only vector
//   measure_speed            all of these but the last
//   measure_speed --vector avx2|sse4|best ...   with kernels limited to a smaller vector unit
// Rigs: single, one lens of 1280x960; pair, two of these; equirect, a whole sphere with as many pixels as 1280x960.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/geometry.hpp>
#include <lightwell/text.hpp>

#include "bench/vector_unit.hpp"
#include "calibration/model/lens_table.hpp"
#include "measure/output.hpp"
#include "measure/speed_bench.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

constexpr const char* kRigs[] = {"single", "pair", "equirect"};
constexpr PixelFormat kFormats[] = {PixelFormat::rgb8, PixelFormat::bayer_rggb8, PixelFormat::nv12, PixelFormat::yuyv};
constexpr int kSizes[][2] = {{640, 480}, {1280, 960}, {1920, 1440}, {2560, 1920}, {3840, 3840}};
/// Images of every size use the same amount of memory in total, more than any cache: eight of 3840x3840.
constexpr std::size_t kBytesOfSizes = 8UL * 3 * 3840 * 3840;
constexpr int kLights = 64;
/// The time varies by up to 6 % with the placement of an estimator's tables in memory. Both sides of a ratio are the
/// best of this number of newly constructed estimators.
constexpr int kPlacements = 6;
constexpr int kPassesInTurns = 8;
/// Lamps of 1.5 degrees (six pixels of 1568x784) with 150 times the room's radiance: each contributes 0.5 % of all
/// light; the estimator ignores lamps below 0.2 %.
constexpr double kLightRadiusRad = 0.75 * std::numbers::pi / 180;
constexpr float kLightRadiance = 150;

std::string vector_unit;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_speed: %s\n", s.message().c_str());
  std::exit(1);
}

void print(const std::string& name, const measure::Speed& s, double seen_pixels = 0) {
  nlohmann::ordered_json out = {{"figure", name},
                                {"value", s.seconds / s.memcpy_seconds},
                                {"ms", s.seconds * 1e3},
                                {"memcpy_gb_per_s", s.bytes / s.memcpy_seconds * 1e-9},
                                {"bytes", std::llround(s.descriptor_bytes)},
                                {"lights", s.lights},
                                {"vector", vector_unit}};
  if (seen_pixels > 0) out["seen_pixels"] = std::llround(seen_pixels);
  measure::print_line(out);
}

measure::SpeedCase case_of(const char* rig) {
  measure::SpeedCase c;
  c.rig = rig;
  const bool sphere = std::strcmp(rig, "equirect") == 0;
  c.width = sphere ? 1568 : 1280;
  c.height = sphere ? 784 : 960;
  return c;
}

void each_format(const sim::Scene& scene, measure::SpeedCase c, const std::string& prefix) {
  c.linear = true;
  print(prefix + "rgb8_linear", measure_speed(scene, c));
  c.linear = false;
  for (const PixelFormat format : kFormats) {
    c.format = format;
    print(prefix + std::string(to_string(format)), measure_speed(scene, c));
  }
}

void formats(const sim::Scene& scene) {
  for (const Setting setting : kSettings) {
    for (const char* rig : kRigs) {
      measure::SpeedCase c = case_of(rig);
      c.config.setting = setting;
      each_format(scene, c, std::string(to_string(setting)) + "." + rig + ".");
    }
  }
}

void brackets(const sim::Scene& scene) {
  for (const char* rig : kRigs) {
    measure::SpeedCase c = case_of(rig);
    c.exposures = {1e-5, 3e-4, 1e-2};
    each_format(scene, c, std::string("bracket.") + rig + ".");
  }
}

double seen_pixels(const measure::SpeedCase& c) {
  const Result<RigParameters> rig = sim::make_rig(c.rig, c.width, c.height, c.format);
  if (!rig) fail(rig.status());
  const Result<RigTable> table = make_rig_table(*rig);
  if (!table) fail(table.status());
  double seen = 0;
  for (const LensTable& lens : table->lenses)
    seen += static_cast<double>(
        std::count_if(lens.solid_angle.begin(), lens.solid_angle.end(), [](auto s) { return s > 0; }));
  return seen;
}

void sizes(const sim::Scene& scene) {
  for (const auto& size : kSizes) {
    measure::SpeedCase c = case_of("single");
    c.width = size[0];
    c.height = size[1];
    c.linear = true;
    c.buffers = kBytesOfSizes / (3UL * static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height));
    const double seen = seen_pixels(c);
    for (const Setting setting : {Setting::fast, Setting::balanced}) {
      c.config.setting = setting;
      const std::string name = formatted("size.%s.%dx%d", std::string(to_string(setting)).c_str(), c.width, c.height);
      print(name, measure_speed(scene, c), seen);
    }
  }
}

sim::Scene room(int lights) {
  std::vector<Vec3d> towards;
  for (int i = 0; i < lights; ++i) {
    const Vec3d d = fibonacci_direction(i, lights);
    towards.push_back({d.x, d.z, d.y});
  }
  return sim::Scene(sim::from_function(2048, [&](Vec3d d) {
    const bool lit = std::any_of(towards.begin(), towards.end(),
                                 [&](const Vec3d& t) { return dot(t, d) > std::cos(kLightRadiusRad); });
    return lit ? Radiance{kLightRadiance, kLightRadiance, kLightRadiance} : Radiance{1, 1, 1};
  }));
}

void lights() {
  const sim::Scene none = room(0), all = room(kLights);
  for (const Setting setting : {Setting::fast, Setting::balanced}) {
    for (const bool linear : {true, false}) {
      measure::SpeedCase c = case_of("equirect");
      c.linear = linear;
      c.config.setting = setting;
      const RigParameters rig = *sim::make_rig(c.rig, c.width, c.height, c.format);
      c.exposures = {sim::exposure_below_saturation(sim::sensor_of(rig, c.format, 1), kLightRadiance, 1)};
      for (const char* choice : {"as_rich_as_needed", "all_sent"}) {
        if (std::strcmp(choice, "all_sent") == 0) {
          c.config.max_lights = kLights;
          c.config.panorama.epsilon = 0;
        }
        measure::Speed without, with;
        for (int placement = 0; placement < kPlacements; ++placement) {
          measure::SpeedBench one(none, c), other(all, c);
          for (int pass = 0; pass < kPassesInTurns; ++pass) {
            one.pass();
            other.pass();
          }
          if (placement == 0 || one.best().seconds < without.seconds) without = one.best();
          if (placement == 0 || other.best().seconds < with.seconds) with = other.best();
        }
        const std::string prefix = std::string("lights.").append(choice) + "." + std::string(to_string(setting)) +
                                   (linear ? ".rgb8_linear." : ".rgb8.");
        print(prefix + "0", without);
        print(prefix + std::to_string(kLights), with);
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Time of the panorama estimator from frame to encoded descriptor, relative to memcpy.", "measure_speed"};
  std::string vector = "best";
  app.add_option("--vector", vector, "best, avx2 or sse4: largest vector unit of the kernels [best]");
  std::string part;
  app.add_option("PART", part, "What is measured; unit: only the name of the vector unit [all but unit]")
      ->check(CLI::IsMember({"unit", "formats", "brackets", "sizes", "lights"}));
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  Result<std::string> unit = bench::select_vector_unit(vector);
  if (!unit) return wrong_usage(app, unit.status().message());
  vector_unit = std::move(*unit);
  if (part == "unit") {
    measure::print_line({{"figure", "unit"}, {"vector", vector_unit}});
    return 0;
  }
  const Result<std::string> path = sim::scene_path("city");
  if (!path) fail(path.status());
  Result<sim::Panorama> panorama = sim::load_panorama(*path);
  if (!panorama) fail(panorama.status());
  const sim::Scene scene(std::move(*panorama));
  if (part.empty() || part == "formats") formats(scene);
  if (part.empty() || part == "brackets") brackets(scene);
  if (part.empty() || part == "sizes") sizes(scene);
  if (part.empty() || part == "lights") lights();
  return 0;
}
