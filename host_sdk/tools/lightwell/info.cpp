#include <cstdio>

#include <lightwell/printable.hpp>
#include <lightwell/probe.hpp>

#include "commands.hpp"
#include "exit_code.hpp"
#include "feed.hpp"
#include "json_line.hpp"
#include "map_wait.hpp"

namespace lightwell::tool {
namespace {

std::string json_of(const ProbeInfo& info, const std::optional<EnvironmentView>& environment, MapInfo map) {
  const Counters& counters = info.counters;
  const auto count = [](std::uint64_t n) { return static_cast<double>(n); };
  JsonLine line;
  line.text("name", info.name)
      .number("id", info.id)
      .number("calibration_id", info.calibration_id)
      .text("version", info.version)
      .text("camera", info.camera)
      .number("clock_offset_ms", info.clock_offset.milliseconds())
      .number("clock_uncertainty_ms", info.clock_uncertainty.milliseconds())
      .number("frames", count(counters.frames))
      .number("captures_dropped", count(counters.captures_dropped))
      .number("brackets_incomplete", count(counters.brackets_incomplete))
      .number("estimates", count(counters.estimates))
      .number("estimates_failed", count(counters.estimates_failed))
      .number("descriptors_coalesced", count(counters.descriptors_coalesced))
      .number("clients", counters.clients)
      .number("frames_recorded", count(counters.frames_recorded))
      .number("recording_faults", count(counters.recording_faults))
      .number("frames_lost", count(counters.frames_lost))
      .number("setting_moves", count(counters.setting_moves))
      .number("estimates_late", count(counters.estimates_late))
      .number("estimates_late_at_fast", count(counters.estimates_late_at_fast))
      .number("messages_refused", count(counters.messages_refused))
      .number("authentication_failures", count(counters.authentication_failures))
      .number("client_list_faults", count(counters.client_list_faults));
  if (map == MapInfo::included)
    line.number("environment_edge", environment ? environment->map.levels.front().edge : 0)
        .number("environment_levels", environment ? static_cast<double>(environment->map.levels.size()) : 0);
  if (const auto& mounting = info.T_world_probe) {
    const auto& [q, t] = mounting->pose;
    const auto list = [](std::initializer_list<double> values) {
      std::string out;
      for (const double v : values) out += (out.empty() ? "[" : ",") + json_number(v);
      return out + "]";
    };
    line.raw("position_m", list({t.x, t.y, t.z})).raw("orientation_xyzw", list({q.x, q.y, q.z, q.w}));
  }
  return line.str();
}

}  // namespace

int run_info(const InfoOptions& options) {
  const Result<ProbeOptions> how = options_with(options.credentials);
  if (!how.ok()) return fail(how.status());
  const Result<Probe> probe = Probe::connect(options.uri, *how);
  if (!probe.ok()) return fail(probe.status());
  const Lighting lighting = options.map == MapInfo::included ? lighting_with_map(*probe) : Lighting();
  const std::optional<EnvironmentView> environment = lighting.environment();
  const ProbeInfo info = probe->info();
  if (options.output == Output::json) {
    std::printf("%s\n", json_of(info, environment, options.map).c_str());
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
  std::printf("budget       setting moved %llu times, late %llu, late at fast %llu\n", wide(counters.setting_moves),
              wide(counters.estimates_late), wide(counters.estimates_late_at_fast));
  std::printf("clients      %u, descriptors coalesced %llu\n", counters.clients, wide(counters.descriptors_coalesced));
  std::printf("refused      %llu messages, %llu unauthenticated calls, %llu invalid client lists\n",
              wide(counters.messages_refused), wide(counters.authentication_failures),
              wide(counters.client_list_faults));
  std::printf("recorded     %llu frames, faults %llu\n", wide(counters.frames_recorded),
              wide(counters.recording_faults));
  if (environment) {
    const EnvironmentMap& map = environment->map;
    std::printf("environment  %dx%d, %zu levels, roughness %.2g to %.2g, key %08x\n", map.levels.front().edge,
                map.levels.front().edge, map.levels.size(), static_cast<double>(map.levels.front().roughness),
                static_cast<double>(map.levels.back().roughness), map.key);
  } else if (options.map == MapInfo::included) {
    std::printf("environment  no map within %.1f s; reflections come from harmonics\n", kMapTimeout.seconds());
  }
  return kOk;
}

}  // namespace lightwell::tool
