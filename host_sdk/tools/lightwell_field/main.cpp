// lightwell-field: lights in space, from several probes; `lightwell field` runs it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/field.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"
#include "field_gltf.hpp"
#include "field_grid.hpp"
#include "field_probes.hpp"

namespace {

using namespace lightwell;
using namespace lightwell::tool;
using nlohmann::ordered_json;

constexpr const char* kHelp =
    R"(The light between several probes: where the lights are, and what the field makes of each probe. Each
probe needs its pose in the room (lightwelld --mounting); one without is listed as such.
  lightwell field grpc://hall.local grpc://stage.local
  lightwell field mqtt://broker/venue/+ --json
A + in the topic of a broker stands for one level: its probes are searched every two seconds, so that they
come and go while it runs. One block per second until Ctrl-C.
--gltf writes the last state when it ends: placed and distant lights (KHR_lights_punctual; lux and candela
if units are absolute) and the rest at the middle of the probes (EXT_lights_image_based).
--grid writes the light at each point of a box as Unity's SphericalHarmonicsL2, for light probes:
  lightwell field mqtt://broker/venue/+ --seconds 5 --grid hall.json --from=-4,0,-3 --to=4,3,3 --spacing 0.5
from and to are in metres, in the field's axes (+Y up, -Z forward); the file has Unity's (+Z forward). At
most 100000 points. --lights-apart leaves lights that shine evenly out of the harmonics and lists them,
for the engine to shade and shadow. The sample LightGrid of the Unity package loads the file.
Keys with --json, an object per second: seconds, units, probes (name, state, reason, position, scale,
lights, matched, ambiguous) and lights (id, placed, position, sigma_m, direction, sigma_rad, intensity,
radius, probes). state: used, stale, expired, wrong_clock, wrong_pose, wrong_scale, contradicted,
no_pose, no_light, unreachable.
Exit codes: 0 ok, 1 no probe gave light, 2 usage, 4 the file cannot be written.)";

volatile std::sig_atomic_t interrupted = 0;
void on_interrupt(int) { interrupted = 1; }

double sigma_m(const FieldLight& light) {
  const auto& c = light.position_covariance;
  return std::sqrt(std::max((c[0] + c[3] + c[5]) / 3, 0.0));
}

ordered_json json_of(const FieldLight& light) {
  ordered_json out{{"id", light.id}, {"placed", light.placed}};
  if (light.placed) {
    out["position"] = {light.position.x, light.position.y, light.position.z};
    out["sigma_m"] = sigma_m(light);
  } else {
    out["direction"] = {light.direction.x, light.direction.y, light.direction.z};
    out["sigma_rad"] = light.direction_sigma_rad;
  }
  out["intensity"] = {light.intensity.r, light.intensity.g, light.intensity.b};
  out["radius"] = light.radius;
  out["probes"] = light.probes;
  return out;
}

void print_state(const FieldState& state, const std::vector<FieldProbes::Absent>& absent, double seconds) {
  ordered_json probes = ordered_json::array(), lights = ordered_json::array();
  for (const FieldProbe& p : state.probes)
    probes.push_back({{"name", printable(p.name)},
                      {"state", to_string(p.state)},
                      {"reason", p.reason},
                      {"position", {p.position.x, p.position.y, p.position.z}},
                      {"scale", p.scale},
                      {"lights", p.lights},
                      {"matched", p.matched},
                      {"ambiguous", p.ambiguous}});
  for (const FieldProbes::Absent& p : absent)
    probes.push_back({{"name", printable(p.name)}, {"state", p.state}, {"reason", printable(p.reason)}});
  for (const FieldLight& light : state.lights) lights.push_back(json_of(light));
  print_json({{"seconds", seconds},
              {"units", state.units == Units::absolute ? "absolute" : "relative"},
              {"probes", std::move(probes)},
              {"lights", std::move(lights)}});
}

void print_text(const FieldState& state, const std::vector<FieldProbes::Absent>& absent, double seconds) {
  std::printf("%.0f s: %zu probes, %zu lights in space\n", seconds, state.probes.size() + absent.size(),
              state.lights.size());
  for (const FieldLight& light : state.lights) {
    const double luminance = static_cast<double>(light.intensity.luminance());
    if (light.placed)
      std::printf("  light %u  at %.2f %.2f %.2f m (within %.3f)  %.4g %s  by %u probes\n", light.id, light.position.x,
                  light.position.y, light.position.z, sigma_m(light), luminance,
                  state.units == Units::absolute ? "cd" : "(relative)", light.probes);
    else
      std::printf("  light %u  distant, towards %.3f %.3f %.3f  %.4g %s  by %u probes\n", light.id,
                  static_cast<double>(light.direction.x), static_cast<double>(light.direction.y),
                  static_cast<double>(light.direction.z), luminance,
                  state.units == Units::absolute ? "lux" : "(relative)", light.probes);
  }
  for (const FieldProbe& p : state.probes)
    std::printf("  %s  %s  %u of %u lights matched%s%s\n", printable(p.name).c_str(),
                std::string(to_string(p.state)).c_str(), p.matched, p.lights, p.reason.empty() ? "" : ": ",
                p.reason.c_str());
  for (const FieldProbes::Absent& p : absent)
    std::printf("  %s  %s: %s\n", printable(p.name).c_str(), p.state.c_str(), printable(p.reason).c_str());
  std::fflush(stdout);
}

/// What the arguments say.
struct Arguments {
  std::vector<std::string> uris;
  std::string gltf;  ///< File to write; empty: none.
  std::string grid;  ///< The same.
  std::string from, to;
  double spacing_m = 0.5;
  GridLights grid_lights = GridLights::in_harmonics;
  double seconds = 0;  ///< 0: until it is interrupted.
  bool json = false;
};

PointGrid grid_of(const Arguments& arguments) {
  const auto from = parse_numbers<double, 3>(arguments.from), to = parse_numbers<double, 3>(arguments.to);
  if (!from || !to) fail(kUsage, "--from and --to are X,Y,Z in metres, as in --from=-4,0,-3");
  return require(PointGrid::with_spacing({(*from)[0], (*from)[1], (*from)[2]}, {(*to)[0], (*to)[1], (*to)[2]},
                                         arguments.spacing_m),
                 kUsage);
}

void watch(const Arguments& arguments) {
  const PointGrid grid = arguments.grid.empty() ? PointGrid() : grid_of(arguments);
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  LightField field = require(LightField::make());
  FieldProbes probes(arguments.uris);
  const HostTime start{monotonic_now_ns()};
  const auto seconds = [&] { return (HostTime{monotonic_now_ns()} - start).seconds(); };
  const double end = arguments.seconds > 0 ? arguments.seconds : std::numeric_limits<double>::infinity();
  bool any_light = false;
  for (double next = 1; interrupted == 0; next += 1) {
    while (interrupted == 0 && seconds() < std::min(next, end))
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const std::vector<FieldProbes::Absent> absent = probes.feed(field);
    const auto state = field.update({monotonic_now_ns()});
    any_light = any_light || !state->probes.empty();
    (arguments.json ? print_state : print_text)(*state, absent, seconds());
    if (seconds() >= end) break;
  }
  if (!any_light) fail(kNothingReceived, "no probe gave light with a pose");
  if (!arguments.gltf.empty()) require(write_field_gltf(field, {monotonic_now_ns()}, arguments.gltf), kFile);
  if (!arguments.grid.empty())
    require(write_field_grid(field, {monotonic_now_ns()}, grid, arguments.grid_lights, arguments.grid), kFile);
}

}  // namespace

int main(int argc, char** argv) {
  // As in the tool lightwell.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  CLI::App app{"Lights in space, from several probes.", "lightwell-field"};
  app.footer(kHelp);
  app.set_version_flag("--version", std::string(version()));
  Arguments arguments;
  app.add_option("URI", arguments.uris, "Probes; mqtt://BROKER/TOPIC/+ stands for all at that level")->required();
  app.add_option("--gltf", arguments.gltf, "Also write the last state to this glTF file");
  CLI::Option* grid =
      app.add_option("--grid", arguments.grid, "Also write the last state as a grid of Unity's light probes");
  CLI::Option* from = app.add_option("--from", arguments.from, "Corner of the grid, X,Y,Z in m")->needs(grid);
  CLI::Option* to = app.add_option("--to", arguments.to, "Opposite corner, X,Y,Z in m")->needs(grid);
  grid->needs(from)->needs(to);
  app.add_option("--spacing", arguments.spacing_m, "Of the grid's points, m, at most")
      ->needs(grid)
      ->capture_default_str();
  app.add_flag_callback(
         "--lights-apart", [&] { arguments.grid_lights = GridLights::apart; },
         "List lights that shine evenly in the grid's file, out of its harmonics")
      ->needs(grid);
  app.add_option("--seconds", arguments.seconds, "Duration; without it, until Ctrl-C")->check(CLI::PositiveNumber);
  app.add_flag("--json", arguments.json, "JSON, one object per line");
  app.callback([&arguments] { watch(arguments); });
  return parse(app, argc, argv);
}
