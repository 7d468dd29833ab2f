// The connection, as C sees it.
#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <lightwell/probe.hpp>

#include "c/call.hpp"
#include "c/sized.hpp"

namespace lightwell::c {
namespace {

static_assert(LW_LINK_CONNECTING == static_cast<int>(LinkState::connecting) &&
              LW_LINK_CONNECTED == static_cast<int>(LinkState::connected) &&
              LW_LINK_WAITING == static_cast<int>(LinkState::waiting) &&
              LW_LINK_ENDED == static_cast<int>(LinkState::ended) && LW_LINK_GONE == static_cast<int>(LinkState::gone));

/// As long as anybody waits, about thirty years. Added to a clock's reading, INT64_MAX would be the past.
constexpr std::int64_t kForeverNs = 1'000'000'000'000'000'000;

/// 0 stands for the default, so that a struct that is zero, or lacks the field, means it.
void set_unless_zero(Duration& field, std::int64_t ns) {
  if (ns != 0) field = {std::min(ns, kForeverNs)};
}

void set_unless_null(std::string& field, const char* text) {
  if (text != nullptr) field = text;
}

Result<ProbeOptions> options_of(const lw_probe_options* given) {
  ProbeOptions out;
  if (given == nullptr) return out;
  lw_probe_options options{};
  if (Status status = read_sized(given, "lw_probe_options", options); !status.ok()) return status;
  if (options.history != 0) out.history = options.history;
  set_unless_zero(out.max_age, options.max_age_ns);
  set_unless_zero(out.extrapolation, options.extrapolation_ns);
  if (options.extrapolation_ns == -1) out.extrapolation = {};
  set_unless_zero(out.connect_timeout, options.connect_timeout_ns);
  set_unless_zero(out.retry_min, options.retry_min_ns);
  set_unless_zero(out.retry_max, options.retry_max_ns);
  set_unless_zero(out.silence_limit, options.silence_limit_ns);
  set_unless_null(out.credentials.folder, options.credentials_folder);
  set_unless_null(out.mqtt.ca_file, options.mqtt_ca_file);
  set_unless_null(out.mqtt.certificate_file, options.mqtt_certificate_file);
  set_unless_null(out.mqtt.key_file, options.mqtt_key_file);
  set_unless_null(out.mqtt.user, options.mqtt_user);
  set_unless_null(out.mqtt.password, options.mqtt_password);
  return out;
}

lw_estimator_config as_c(const EstimatorConfig& config) {
  lw_estimator_config out{};
  out.size = sizeof out;
  out.band = config.band;
  out.max_lights = config.max_lights;
  out.setting = static_cast<std::int32_t>(config.setting);
  out.unseen = static_cast<std::int32_t>(config.panorama.unseen);
  out.smoothing = static_cast<std::int32_t>(config.panorama.smoothing);
  out.environment_edge = config.panorama.environment_edge;
  out.light_threshold = config.panorama.light_threshold;
  out.epsilon = config.panorama.epsilon;
  out.radiance_epsilon = config.panorama.radiance_epsilon;
  out.environment_rate = config.panorama.environment_rate;
  out.marker_decimation = config.marker.decimation;
  out.marker_search_decimation = config.marker.search_decimation;
  out.marker_max_faces = config.marker.max_faces;
  return out;
}

/// What EstimatorConfig::validate() would not see: a number that is none of the enum's, and becomes one when it is cut.
Status in_range(std::int32_t value, std::int32_t last, const char* what) {
  if (value >= 1 && value <= last) return {};
  return invalid("lw_estimator_config." + std::string(what) + " is " + std::to_string(value) + "; it is 1 to " +
                 std::to_string(last));
}

Result<EstimatorConfig> config_of(const lw_estimator_config* given) {
  lw_estimator_config c = as_c({});
  if (Status status = read_sized(given, "lw_estimator_config", c); !status.ok()) return status;
  if (Status status = in_range(c.setting, 3, "setting"); !status.ok()) return status;
  if (Status status = in_range(c.unseen, 3, "unseen"); !status.ok()) return status;
  if (Status status = in_range(c.smoothing, 2, "smoothing"); !status.ok()) return status;
  if (c.reserved != 0 || c.reserved_2 != 0) return invalid("lw_estimator_config.reserved is not 0");
  EstimatorConfig out;
  out.band = c.band;
  out.max_lights = c.max_lights;
  out.setting = static_cast<Setting>(c.setting);
  out.panorama.unseen = static_cast<UnseenFill>(c.unseen);
  out.panorama.smoothing = static_cast<Smoothing>(c.smoothing);
  out.panorama.environment_edge = c.environment_edge;
  out.panorama.light_threshold = c.light_threshold;
  out.panorama.epsilon = c.epsilon;
  out.panorama.radiance_epsilon = c.radiance_epsilon;
  out.panorama.environment_rate = c.environment_rate;
  out.marker.decimation = c.marker_decimation;
  out.marker.search_decimation = c.marker_search_decimation;
  out.marker.max_faces = c.marker_max_faces;
  return out;
}

lw_probe_info as_c(const ProbeInfo& info) {
  lw_probe_info out{};
  out.size = sizeof out;
  out.id = info.id;
  out.calibration_id = info.calibration_id;
  out.clients = info.counters.clients;
  out.clock_offset_ns = info.clock_offset.ns;
  out.clock_uncertainty_ns = info.clock_uncertainty.ns;
  out.clock_drift_ppm = info.clock_drift_ppm;
  out.frames = info.counters.frames;
  out.captures_dropped = info.counters.captures_dropped;
  out.brackets_incomplete = info.counters.brackets_incomplete;
  out.estimates = info.counters.estimates;
  out.estimates_failed = info.counters.estimates_failed;
  out.descriptors_coalesced = info.counters.descriptors_coalesced;
  out.frames_recorded = info.counters.frames_recorded;
  out.recording_faults = info.counters.recording_faults;
  out.frames_lost = info.counters.frames_lost;
  out.setting_moves = info.counters.setting_moves;
  out.estimates_late = info.counters.estimates_late;
  out.estimates_late_at_fast = info.counters.estimates_late_at_fast;
  out.messages_refused = info.counters.messages_refused;
  out.authentication_failures = info.counters.authentication_failures;
  if (info.T_world_probe) {
    const auto& [q, t] = info.T_world_probe->pose;
    out.mounted = 1;
    std::ranges::copy(std::array{t.x, t.y, t.z}, out.position);
    std::ranges::copy(std::array{q.x, q.y, q.z, q.w}, out.orientation);
  }
  return out;
}

lw_link_stats as_c(const LinkStats& stats) {
  lw_link_stats out{};
  out.size = sizeof out;
  out.state = static_cast<lw_link_state>(stats.state);
  out.received = stats.received;
  out.bytes = stats.bytes;
  out.gaps = stats.gaps;
  out.oversized = stats.oversized;
  out.undecodable = stats.undecodable;
  out.replayed = stats.replayed;
  out.reconnects = stats.reconnects;
  out.maps = stats.maps;
  out.maps_without_key = stats.maps_without_key;
  out.frames_lost = stats.frames_lost;
  out.frames_refused = stats.frames_refused;
  out.untimely = stats.untimely;
  return out;
}

Result<std::string> text_of(const Probe& probe, lw_probe_text_kind kind) {
  switch (kind) {
    case LW_PROBE_NAME:
      return probe.info().name;
    case LW_PROBE_VERSION:
      return probe.info().version;
    case LW_PROBE_CAMERA:
      return probe.info().camera;
    case LW_PROBE_LAST_ERROR:
      return probe.stats().last_error;
    default:
      return invalid("lw_probe_text: there is no text " + std::to_string(kind));
  }
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_probe_connect(const char* uri, size_t uri_length, const lw_probe_options* options, lw_probe** out) {
  return call([&]() -> Status {
    if (out == nullptr) return invalid("out is NULL: where should the probe go?");
    if (uri == nullptr)
      return invalid(
          "uri is NULL; it is grpc://HOST:PORT, grpcs://, usb:SERIAL, mqtt://BROKER/TOPIC, mqtts:// or replay:PATH");
    Result<ProbeOptions> asked = options_of(options);
    if (!asked.ok()) return asked.status();
    const std::string_view where(uri, uri_length == LW_ZERO_TERMINATED ? std::strlen(uri) : uri_length);
    Result<Probe> probe = Probe::connect(where, *asked);
    if (!probe.ok()) return probe.status();
    *out = std::make_unique<lw_probe>(std::move(*probe)).release();
    return {};
  });
}

void lw_probe_close(lw_probe* probe) {
  if (good(probe)) delete probe;
}

lw_status lw_probe_latest(const lw_probe* probe, lw_lighting* into) {
  return with_probe(probe, [&](const Probe& p) -> Status {
    if (!good(into)) return invalid("`into` is no lw_lighting of lw_lighting_create");
    into->value = p.latest();
    return {};
  });
}

lw_status lw_probe_latest_in_world(const lw_probe* probe, lw_lighting* into) {
  return with_probe(probe, [&](const Probe& p) -> Status {
    if (!good(into)) return invalid("`into` is no lw_lighting of lw_lighting_create");
    into->value = p.latest_in_world();
    return {};
  });
}

lw_status lw_probe_at(const lw_probe* probe, int64_t host_time_ns, lw_lighting* into) {
  return with_probe(probe, [&](const Probe& p) -> Status {
    if (!good(into)) return invalid("`into` is no lw_lighting of lw_lighting_create");
    into->value = p.at({host_time_ns});
    return {};
  });
}

lw_status lw_probe_wait_for_next(const lw_probe* probe, const uint64_t* seen, int64_t timeout_ns, lw_lighting* into) {
  return with_probe(probe, [&](const Probe& p) -> Status {
    if (!good(into)) return invalid("`into` is no lw_lighting of lw_lighting_create");
    const auto other_than = seen == nullptr ? std::nullopt : std::optional<std::uint64_t>(*seen);
    Result<Lighting> next = p.wait_for_next(other_than, {std::min(timeout_ns, kForeverNs)});
    if (!next.ok()) return next.status();
    into->value = std::move(*next);
    return {};
  });
}

lw_status lw_probe_get_info(const lw_probe* probe, lw_probe_info* out) {
  return with_probe(probe, [&](const Probe& p) { return write_sized(as_c(p.info()), "lw_probe_info", out); });
}

lw_status lw_probe_get_stats(const lw_probe* probe, lw_link_stats* out) {
  return with_probe(probe, [&](const Probe& p) { return write_sized(as_c(p.stats()), "lw_link_stats", out); });
}

lw_status lw_probe_text(const lw_probe* probe, lw_probe_text_kind kind, char* text, size_t capacity, size_t* length) {
  return with_probe(probe, [&](const Probe& p) -> Status {
    const Result<std::string> found = text_of(p, kind);
    return found.ok() ? copy_text(*found, text, capacity, length) : found.status();
  });
}

lw_status lw_estimator_config_defaults(lw_estimator_config* config) {
  return call([&] { return write_sized(as_c(EstimatorConfig{}), "lw_estimator_config", config); });
}

lw_status lw_probe_set_estimator(lw_probe* probe, const lw_estimator_config* config) {
  return with_probe(probe, [&](const Probe&) -> Status {
    const Result<EstimatorConfig> asked = config_of(config);
    return asked.ok() ? probe->value.set_estimator(*asked) : asked.status();
  });
}

lw_status lw_probe_report_lux(lw_probe* probe, double lux, const float* normal, double* factor) {
  return with_probe(probe, [&](const Probe&) -> Status {
    if (normal == nullptr) return invalid("normal is NULL; it is where the lux meter faces");
    const Result<double> applied = probe->value.report_lux(lux, {normal[0], normal[1], normal[2]});
    if (!applied.ok()) return applied.status();
    if (factor != nullptr) *factor = *applied;
    return {};
  });
}

}  // extern "C"
