#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

/// Limit of the wait for the first descriptor.
constexpr Duration kTimeout{5'000'000'000};

std::optional<Vec3f> vector_of(std::string_view text) {
  const auto v = parse_numbers<float, 3>(text);
  if (!v) return std::nullopt;
  const Vec3f out{(*v)[0], (*v)[1], (*v)[2]};
  if (normalized(out) == Vec3f{}) return std::nullopt;
  return out;
}

/// `source`: "map" or "harmonics" for a radiance; empty for an irradiance.
template <class T>
void print_answer(std::string_view what, const Answer<T>& answer, std::string_view unit, std::string_view source,
                  bool json) {
  const auto value = answer.value;
  if (json) {
    nlohmann::ordered_json out = {{"quantity", what},
                                  {"rgb", std::array{value.r, value.g, value.b}},
                                  {"luminance", value.luminance()},
                                  {"unit", unit},
                                  {"lights", answer.lights == LightsIncluded::yes ? "included" : "left_out"},
                                  {"validity", to_string(answer.validity)},
                                  {"age_ms", answer.age.milliseconds()},
                                  {"bound", answer.error_bound},
                                  {"flags", flag_names(answer.flags)}};
    if (!source.empty()) out["source"] = source;
    print_json(out);
    return;
  }
  std::printf("%s  %.6g %.6g %.6g  luminance %.6g %s%s  %s  age %.1f ms  bound %s  flags %s%s%s\n",
              std::string(what).c_str(), static_cast<double>(value.r), static_cast<double>(value.g),
              static_cast<double>(value.b), static_cast<double>(value.luminance()), std::string(unit).c_str(),
              answer.lights == LightsIncluded::yes ? "" : "  lights left out",
              std::string(to_string(answer.validity)).c_str(), answer.age.milliseconds(),
              bound_text(answer.error_bound).c_str(), flags_text(answer.flags).c_str(), source.empty() ? "" : "  from ",
              std::string(source).c_str());
}

/// With the position, m, of a near lamp; nullopt if it is not known.
void print_light(const Light& light, const std::optional<Vec3d>& position, std::string_view unit, bool json) {
  const Vec3f d = light.direction;
  const Irradiance e = light.irradiance;
  const double radius_deg = static_cast<double>(light.angular_radius_rad) * 180 / 3.14159265358979;
  if (json) {
    nlohmann::ordered_json out = {{"quantity", "light"},
                                  {"track", light.track},
                                  {"direction", std::array{d.x, d.y, d.z}},
                                  {"rgb", std::array{e.r, e.g, e.b}},
                                  {"luminance", e.luminance()},
                                  {"unit", unit},
                                  {"angular_radius_deg", radius_deg},
                                  {"direction_covariance", light.direction_covariance}};
    if (position) {
      out["distance_m"] = light.distance_m;
      out["distance_sigma_m"] = light.distance_sigma_m;
      out["position"] = std::array{position->x, position->y, position->z};
    }
    print_json(out);
    return;
  }
  std::string place;
  if (position)
    place = formatted("  distance %.4g +- %.2g m  position %.4f %.4f %.4f m", static_cast<double>(light.distance_m),
                      static_cast<double>(light.distance_sigma_m), position->x, position->y, position->z);
  std::printf(
      "light %u  towards %.4f %.4f %.4f  irradiance %.6g %.6g %.6g  luminance %.6g %s  "
      "radius %.2f deg%s\n",
      light.track, static_cast<double>(d.x), static_cast<double>(d.y), static_cast<double>(d.z),
      static_cast<double>(e.r), static_cast<double>(e.g), static_cast<double>(e.b), static_cast<double>(e.luminance()),
      std::string(unit).c_str(), radius_deg, place.c_str());
}

/// The pose of the point at which the light holds, if that is not the probe.
void print_origin(const Pose& origin, bool json) {
  if (origin == Pose{}) return;
  const auto& [q, t] = origin;
  if (json) {
    print_json({{"quantity", "origin"},
                {"position", std::array{t.x, t.y, t.z}},
                {"orientation", std::array{q.x, q.y, q.z, q.w}}});
    return;
  }
  std::printf("origin  position %.4f %.4f %.4f m  orientation %.5f %.5f %.5f %.5f\n", t.x, t.y, t.z, q.x, q.y, q.z,
              q.w);
}

}  // namespace

int run_query(const Options& options) {
  const std::optional<Vec3f> normal = vector_of(options.normal);
  const std::optional<Vec3f> direction = vector_of(options.direction);
  if (!options.normal.empty() && !normal)
    fail(kUsage, "--normal '" + options.normal + "': three numbers x,y,z, not all zero");
  if (!options.direction.empty() && !direction)
    fail(kUsage, "--direction '" + options.direction + "': three numbers x,y,z, not all zero");
  if (!normal && !direction && !options.lights)
    fail(kUsage, "nothing to query; give --normal x,y,z, --direction x,y,z or --lights");

  const Probe probe = connect(options);
  const Result<Lighting> first = probe.wait_for_next(std::nullopt, kTimeout);
  require(first.status().in(options.uri), kNothingReceived);
  const Lighting lighting = direction ? lighting_with_map(probe) : *first;
  const bool absolute = lighting.units() == Units::absolute;
  if (normal) print_answer("irradiance", lighting.irradiance(*normal), absolute ? "lux" : "relative", "", options.json);
  if (direction)
    print_answer("radiance", lighting.radiance(*direction, static_cast<float>(options.roughness)),
                 absolute ? "cd/m2" : "relative", lighting.environment() ? "map" : "harmonics", options.json);
  if (!options.lights) return kOk;
  print_origin(lighting.origin(), options.json);
  for (const Light& light : lighting.lights())
    print_light(light, lighting.position(light), absolute ? "lux" : "relative", options.json);
  return kOk;
}

}  // namespace lightwell::tool
