#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

nlohmann::ordered_json json_of(const ProbeInfo& info, const std::optional<EnvironmentView>& environment, bool no_map) {
  const Counters& counters = info.counters;
  nlohmann::ordered_json out = {{"name", info.name},
                                {"id", info.id},
                                {"calibration_id", info.calibration_id},
                                {"version", info.version},
                                {"camera", info.camera},
                                {"clock_offset_ms", info.clock_offset.milliseconds()},
                                {"clock_uncertainty_ms", info.clock_uncertainty.milliseconds()},
                                {"frames", counters.frames},
                                {"captures_dropped", counters.captures_dropped},
                                {"brackets_incomplete", counters.brackets_incomplete},
                                {"estimates", counters.estimates},
                                {"estimates_failed", counters.estimates_failed},
                                {"descriptors_coalesced", counters.descriptors_coalesced},
                                {"clients", counters.clients},
                                {"frames_recorded", counters.frames_recorded},
                                {"recording_faults", counters.recording_faults},
                                {"frames_lost", counters.frames_lost},
                                {"setting_moves", counters.setting_moves},
                                {"estimates_late", counters.estimates_late},
                                {"estimates_late_at_fast", counters.estimates_late_at_fast},
                                {"messages_refused", counters.messages_refused},
                                {"authentication_failures", counters.authentication_failures},
                                {"client_list_faults", counters.client_list_faults}};
  out["recording"] = info.recording ? recording_json(*info.recording) : nlohmann::ordered_json();
  if (info.temperature_c) out["temperature_c"] = *info.temperature_c;
  out["links"] = nlohmann::ordered_json::array();
  for (const LinkStatus& link : info.links)
    out["links"].push_back({{"name", link.name},
                            {"clients", link.clients},
                            {"descriptors_coalesced", link.descriptors_coalesced},
                            {"messages_refused", link.messages_refused},
                            {"authentication_failures", link.authentication_failures},
                            {"fault", link.fault}});
  if (!no_map) {
    out["environment_edge"] = environment ? environment->map.levels.front().edge : 0;
    out["environment_levels"] = environment ? environment->map.levels.size() : 0;
  }
  if (const auto& mounting = info.T_world_probe) {
    const auto& [q, t] = mounting->pose;
    out["position_m"] = std::array{t.x, t.y, t.z};
    out["orientation_xyzw"] = std::array{q.x, q.y, q.z, q.w};
  }
  return out;
}

}  // namespace

int run_info(const Options& options) {
  const Probe probe = connect(options);
  const Lighting lighting = options.no_map ? Lighting() : lighting_with_map(probe);
  const std::optional<EnvironmentView> environment = lighting.environment();
  const ProbeInfo info = probe.info();
  if (options.json) {
    print_json(json_of(info, environment, options.no_map));
    return kOk;
  }
  const Counters& counters = info.counters;
  if (const auto& mounting = info.T_world_probe) {
    const Vec3d& at = mounting->pose.translation;
    const Vec3d ahead = rotate(mounting->pose.rotation, Vec3d{0, 0, -1}),
                up = rotate(mounting->pose.rotation, Vec3d{0, 1, 0});
    std::printf("mounting     at (%.3f, %.3f, %.3f) m, forward (%.3f, %.3f, %.3f), up (%.3f, %.3f, %.3f)\n", at.x, at.y,
                at.z, ahead.x, ahead.y, ahead.z, up.x, up.y, up.z);
  }
  const auto wide = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("name         %s (%08x)\n", printable(info.name).c_str(), info.id);
  std::printf("firmware     %s\n", printable(info.version).c_str());
  std::printf("camera       %s, calibration %08x\n", printable(info.camera).c_str(), info.calibration_id);
  std::printf("clock        %.3f ms ahead of this host's, +-%.3f ms\n", info.clock_offset.milliseconds(),
              info.clock_uncertainty.milliseconds());
  std::printf("frames       %llu, lost %llu, captures dropped %llu, brackets incomplete %llu\n", wide(counters.frames),
              wide(counters.frames_lost), wide(counters.captures_dropped), wide(counters.brackets_incomplete));
  std::printf("estimates    %llu, failed %llu\n", wide(counters.estimates), wide(counters.estimates_failed));
  std::printf("budget       setting moved %llu times, late %llu, late at the cheapest %llu\n",
              wide(counters.setting_moves), wide(counters.estimates_late), wide(counters.estimates_late_at_fast));
  std::printf("clients      %u, descriptors coalesced %llu\n", counters.clients, wide(counters.descriptors_coalesced));
  std::printf("refused      %llu messages, %llu unauthenticated calls, %llu invalid client lists\n",
              wide(counters.messages_refused), wide(counters.authentication_failures),
              wide(counters.client_list_faults));
  std::printf("recorded     %llu frames of the camera by lightwelld --record, faults %llu\n",
              wide(counters.frames_recorded), wide(counters.recording_faults));
  std::printf("recording    %s\n", info.recording ? recording_text(*info.recording).c_str()
                                                  : "clients cannot record: the probe has no folder for it");
  if (info.temperature_c) std::printf("temperature  %.1f degrees Celsius\n", static_cast<double>(*info.temperature_c));
  for (const LinkStatus& link : info.links)
    std::printf("link         %s: %u clients, coalesced %llu, refused %llu, unauthenticated %llu%s\n",
                printable(link.name).c_str(), link.clients, wide(link.descriptors_coalesced),
                wide(link.messages_refused), wide(link.authentication_failures),
                link.fault ? "; it has a fault, see the probe's log" : "");
  if (environment) {
    const EnvironmentMap& map = environment->map;
    std::printf("environment  %dx%d, %zu levels, roughness %.2g to %.2g, key %08x\n", map.levels.front().edge,
                map.levels.front().edge, map.levels.size(), static_cast<double>(map.levels.front().roughness),
                static_cast<double>(map.levels.back().roughness), map.key);
  } else if (!options.no_map) {
    std::printf("environment  no map within %.1f s; reflections come from harmonics\n", kMapTimeout.seconds());
  }
  return kOk;
}

int run_config_get(const Options& options) {
  const Probe probe = connect(options);
  const EstimatorConfig config = require(probe.estimator_config());
  const EstimatorKind kind = require(probe.estimator_kind());
  const std::vector<ConfigField> fields = fields_of({kind, config});
  if (options.json) {
    nlohmann::ordered_json out;
    out["estimator"] = to_string(kind);
    for (const ConfigField& f : fields) {
      out[f.name] = f.value;
      if (f.type != ConfigField::Type::number) continue;
      if (const auto number = nlohmann::ordered_json::parse(f.value, nullptr, false); number.is_number())
        out[f.name] = number;
    }
    print_json(out);
    return kOk;
  }
  std::printf("# estimator: %s\n", std::string(to_string(kind)).c_str());
  for (const ConfigField& f : fields) std::printf("%s=%s\n", f.name.c_str(), f.value.c_str());
  return kOk;
}

int run_config_set(const Options& options) {
  // Report misspelt fields before connecting.
  EstimatorUpdate update;
  for (const std::string& field : options.fields) {
    const auto equals = field.find('=');
    if (equals == std::string::npos) fail(kUsage, "'" + field + "' is not NAME=VALUE; see lightwell config set --help");
    const std::string name = field.substr(0, equals), current = current_option_name(name);
    if (current != name) warn("field '" + name + "' is now called '" + current + "': the former name is deprecated");
    require(set_field(update, name, field.substr(equals + 1)));
  }
  require(connect(options).change_estimator(update));
  return kOk;
}

}  // namespace lightwell::tool
