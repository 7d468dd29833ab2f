#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/field.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"
#include "field_gltf.hpp"
#include "field_probes.hpp"

namespace lightwell::tool {
namespace {

using nlohmann::ordered_json;

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

}  // namespace

int run_field(const Options& options) {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  LightField field = require(LightField::make());
  FieldProbes probes(options.uris);
  const HostTime start{monotonic_now_ns()};
  const auto seconds = [&] { return (HostTime{monotonic_now_ns()} - start).seconds(); };
  const double end = options.seconds > 0 ? options.seconds : std::numeric_limits<double>::infinity();
  bool any_light = false;
  for (double next = 1; interrupted == 0; next += 1) {
    while (interrupted == 0 && seconds() < std::min(next, end))
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const std::vector<FieldProbes::Absent> absent = probes.feed(field);
    const auto state = field.update({monotonic_now_ns()});
    any_light = any_light || !state->probes.empty();
    (options.json ? print_state : print_text)(*state, absent, seconds());
    if (seconds() >= end) break;
  }
  if (!options.gltf.empty()) require(write_field_gltf(field, {monotonic_now_ns()}, options.gltf), kFile);
  if (!any_light) fail(kNothingReceived, "no probe gave light with a pose");
  return kOk;
}

}  // namespace lightwell::tool
