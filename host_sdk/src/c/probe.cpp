// C ABI of Probe.
#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include <lightwell/probe.hpp>

#include "c/call.hpp"

namespace lightwell::c {
namespace {

static_assert(LW_LINK_CONNECTING == static_cast<int>(LinkState::connecting) &&
              LW_LINK_CONNECTED == static_cast<int>(LinkState::connected) &&
              LW_LINK_WAITING == static_cast<int>(LinkState::waiting) &&
              LW_LINK_ENDED == static_cast<int>(LinkState::ended) && LW_LINK_GONE == static_cast<int>(LinkState::gone));

/// Limit of durations, about thirty years: adding INT64_MAX to a clock value would overflow.
constexpr std::int64_t kForeverNs = 1'000'000'000'000'000'000;

/// 0 means the default, so that a zeroed struct, or one without the field, has the default.
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
  if (options.plane < 0 || options.plane > 1 || options.reserved != 0)
    return invalid("lw_probe_options.plane is " + std::to_string(options.plane) + "; it is 0 or 1, and reserved is 0");
  if (options.plane == 1) out.plane = PlaneReception::receive;
  return out;
}

static_assert(LW_ESTIMATOR_PANORAMA == static_cast<int>(EstimatorKind::panorama) &&
              LW_ESTIMATOR_MARKER == static_cast<int>(EstimatorKind::marker) &&
              LW_ESTIMATOR_SPECULAR == static_cast<int>(EstimatorKind::specular) && kEstimatorKinds.size() == 3);

/// A field of lw_estimator_config, and the corresponding one of EstimatorConfig and EstimatorUpdate.
template <class Given, class Member>
struct ConfigMember {
  std::uint64_t bit;
  const char* name;
  Given lw_estimator_config::*given;
  Member member;
};

constexpr auto kConfigMembers = std::tuple{
    ConfigMember{LW_FIELD_BAND, "band", &lw_estimator_config::band, [](auto& s) -> decltype(auto) { return (s.band); }},
    ConfigMember{LW_FIELD_MAX_LIGHTS, "max_lights", &lw_estimator_config::max_lights,
                 [](auto& s) -> decltype(auto) { return (s.max_lights); }},
    ConfigMember{LW_FIELD_SETTING, "setting", &lw_estimator_config::setting,
                 [](auto& s) -> decltype(auto) { return (s.setting); }},
    ConfigMember{LW_FIELD_UNSEEN, "unseen", &lw_estimator_config::unseen,
                 [](auto& s) -> decltype(auto) { return (s.panorama.unseen); }},
    ConfigMember{LW_FIELD_SMOOTHING, "smoothing", &lw_estimator_config::smoothing,
                 [](auto& s) -> decltype(auto) { return (s.panorama.smoothing); }},
    ConfigMember{LW_FIELD_ENVIRONMENT_EDGE, "environment_edge", &lw_estimator_config::environment_edge,
                 [](auto& s) -> decltype(auto) { return (s.panorama.environment_edge); }},
    ConfigMember{LW_FIELD_LIGHT_THRESHOLD, "light_threshold", &lw_estimator_config::light_threshold,
                 [](auto& s) -> decltype(auto) { return (s.panorama.light_threshold); }},
    ConfigMember{LW_FIELD_EPSILON, "epsilon", &lw_estimator_config::epsilon,
                 [](auto& s) -> decltype(auto) { return (s.panorama.epsilon); }},
    ConfigMember{LW_FIELD_RADIANCE_EPSILON, "radiance_epsilon", &lw_estimator_config::radiance_epsilon,
                 [](auto& s) -> decltype(auto) { return (s.panorama.radiance_epsilon); }},
    ConfigMember{LW_FIELD_ENVIRONMENT_RATE, "environment_rate", &lw_estimator_config::environment_rate,
                 [](auto& s) -> decltype(auto) { return (s.panorama.environment_rate); }},
    ConfigMember{LW_FIELD_MARKER_DECIMATION, "marker_decimation", &lw_estimator_config::marker_decimation,
                 [](auto& s) -> decltype(auto) { return (s.marker.decimation); }},
    ConfigMember{LW_FIELD_MARKER_SEARCH_DECIMATION, "marker_search_decimation",
                 &lw_estimator_config::marker_search_decimation,
                 [](auto& s) -> decltype(auto) { return (s.marker.search_decimation); }},
    ConfigMember{LW_FIELD_MARKER_MAX_FACES, "marker_max_faces", &lw_estimator_config::marker_max_faces,
                 [](auto& s) -> decltype(auto) { return (s.marker.max_faces); }},
    ConfigMember{LW_FIELD_SPECULAR_ENVIRONMENT_EDGE, "specular_environment_edge",
                 &lw_estimator_config::specular_environment_edge,
                 [](auto& s) -> decltype(auto) { return (s.specular.environment_edge); }},
    ConfigMember{LW_FIELD_INTERLEAVE, "interleave", &lw_estimator_config::interleave,
                 [](auto& s) -> decltype(auto) { return (s.panorama.interleave); }},
    ConfigMember{LW_FIELD_MAX_BYTES, "max_bytes", &lw_estimator_config::max_bytes,
                 [](auto& s) -> decltype(auto) { return (s.panorama.max_bytes); }},
};

template <class Visit>
void for_each_member(Visit&& visit) {
  std::apply([&](const auto&... member) { (visit(member), ...); }, kConfigMembers);
}

lw_estimator_config as_c(const EstimatorConfig& config) {
  lw_estimator_config out{};
  out.size = sizeof out;
  for_each_member([&](const auto& m) {
    auto& field = out.*m.given;
    field = static_cast<std::remove_reference_t<decltype(field)>>(m.member(config));
  });
  return out;
}

/// Enums are int32_t in the C ABI: an invalid value must not become a valid one by truncation.
template <class Value, class Given>
bool convert(Given given, Value& out) {
  out = static_cast<Value>(given);
  return static_cast<Given>(out) == given;
}

/// Copies the fields selected by `fields` into an update; `size` is the size of the application's struct.
Result<EstimatorUpdate> update_of(const lw_estimator_config& c, std::uint64_t fields, std::size_t size) {
  if (c.reserved != 0) return invalid("lw_estimator_config.reserved is not 0");
  EstimatorUpdate out;
  Status status;
  for_each_member([&](const auto& m) {
    if ((fields & m.bit) == 0 || !status.ok()) return;
    fields &= ~m.bit;
    const auto& given = c.*m.given;
    const std::string name = "lw_estimator_config." + std::string(m.name);
    if (reinterpret_cast<const char*>(&given + 1) - reinterpret_cast<const char*>(&c) > static_cast<long>(size))
      status = invalid(name + " is beyond lw_estimator_config.size; set that to sizeof(lw_estimator_config)");
    else if (!convert(given, m.member(out).emplace()))
      status = invalid(name + " is " + std::to_string(given) + ", which is not one of its values");
  });
  if (!status.ok()) return status;
  if (fields != 0)
    return invalid(
        "fields has bits that this library does not know: " + std::to_string(fields) +
        "; they are LW_FIELD_..., or an older liblightwell is loaded than the application was compiled with");
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
  out.client_list_faults = info.counters.client_list_faults;
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
    if (out == nullptr) return invalid("out is NULL; pass the address of a pointer for the probe");
    if (uri == nullptr)
      return invalid(
          "uri is NULL; it is grpc://HOST:PORT, grpcs://, usb:SERIAL, mqtt://BROKER/TOPIC, mqtts:// or replay:PATH");
    Result<ProbeOptions> parsed_options = options_of(options);
    if (!parsed_options.ok()) return parsed_options.status();
    const std::string_view where(uri, uri_length == LW_ZERO_TERMINATED ? std::strlen(uri) : uri_length);
    Result<Probe> probe = Probe::connect(where, *parsed_options);
    if (!probe.ok()) return probe.status();
    *out = std::make_unique<lw_probe>(std::move(*probe)).release();
    return {};
  });
}

void lw_probe_close(lw_probe* probe) {
  if (good(probe)) delete probe;
}

lw_status lw_probe_latest(const lw_probe* probe, lw_lighting* into) {
  return fill(probe, into, [](const Probe& p) { return p.latest(); });
}

lw_status lw_probe_latest_in_world(const lw_probe* probe, lw_lighting* into) {
  return fill(probe, into, [](const Probe& p) { return p.latest_in_world(); });
}

lw_status lw_probe_at(const lw_probe* probe, int64_t host_time_ns, lw_lighting* into) {
  return fill(probe, into, [&](const Probe& p) { return p.at({host_time_ns}); });
}

lw_status lw_probe_wait_for_next(const lw_probe* probe, const uint64_t* seen, int64_t timeout_ns, lw_lighting* into) {
  return fill(probe, into, [&](const Probe& p) {
    const auto other_than = seen == nullptr ? std::nullopt : std::optional<std::uint64_t>(*seen);
    return p.wait_for_next(other_than, {std::min(timeout_ns, kForeverNs)});
  });
}

lw_status lw_probe_get_info(const lw_probe* probe, lw_probe_info* out) {
  return with_handle(probe, [&](const Probe& p) { return write_sized(as_c(p.info()), "lw_probe_info", out); });
}

lw_status lw_probe_get_stats(const lw_probe* probe, lw_link_stats* out) {
  return with_handle(probe, [&](const Probe& p) { return write_sized(as_c(p.stats()), "lw_link_stats", out); });
}

lw_status lw_probe_text(const lw_probe* probe, lw_probe_text_kind kind, char* text, size_t capacity, size_t* length) {
  return with_handle(probe, [&](const Probe& p) -> Status {
    const Result<std::string> found = text_of(p, kind);
    return found.ok() ? copy_text(*found, text, capacity, length) : found.status();
  });
}

lw_status lw_estimator_config_defaults(lw_estimator_config* config) {
  return call([&] { return write_sized(as_c(EstimatorConfig{}), "lw_estimator_config", config); });
}

lw_status lw_probe_get_estimator(const lw_probe* probe, lw_estimator_config* config) {
  return with_handle(probe, [&](const Probe& p) -> Status {
    const Result<EstimatorConfig> found = p.estimator_config();
    return found.ok() ? write_sized(as_c(*found), "lw_estimator_config", config) : found.status();
  });
}

lw_status lw_probe_get_estimator_kind(const lw_probe* probe, lw_estimator_kind* kind) {
  return with_handle(probe, [&](const Probe& p) -> Status {
    if (kind == nullptr) return invalid("kind is NULL; pass the address of a variable for it");
    const Result<EstimatorKind> found = p.estimator_kind();
    if (found.ok()) *kind = static_cast<lw_estimator_kind>(*found);
    return found.status();
  });
}

lw_status lw_probe_change_estimator(lw_probe* probe, const lw_estimator_config* config, uint64_t fields) {
  return with_handle(probe, [&](const Probe&) -> Status {
    lw_estimator_config c{};
    std::uint32_t size = 0;
    if (Status status = size_of(config, "lw_estimator_config", size); !status.ok()) return status;
    if (Status status = read_sized(config, "lw_estimator_config", c); !status.ok()) return status;
    const Result<EstimatorUpdate> update = update_of(c, fields, size);
    return update.ok() ? probe->value.change_estimator(*update) : update.status();
  });
}

lw_status lw_probe_set_estimator(lw_probe* probe, const lw_estimator_config* config) {
  return with_handle(probe, [&](const Probe&) -> Status {
    lw_estimator_config c = as_c(EstimatorConfig{});
    if (Status status = read_sized(config, "lw_estimator_config", c); !status.ok()) return status;
    // 0 if the application sets only the fields that it knows; then the default applies.
    if (c.marker_search_decimation == 0) c.marker_search_decimation = MarkerEstimatorConfig{}.search_decimation;
    std::uint64_t fields = 0;
    for_each_member([&](const auto& m) { fields |= m.bit; });
    const Result<EstimatorUpdate> all = update_of(c, fields, sizeof c);
    return all.ok() ? probe->value.set_estimator(updated({}, *all)) : all.status();
  });
}

lw_status lw_probe_report_lux(lw_probe* probe, double lux, const float* normal, double* factor) {
  return with_handle(probe, [&](const Probe&) -> Status {
    if (normal == nullptr) return invalid("normal is NULL; it is the direction in which the lux meter faces");
    const Result<double> applied = probe->value.report_lux(lux, {normal[0], normal[1], normal[2]});
    if (!applied.ok()) return applied.status();
    if (factor != nullptr) *factor = *applied;
    return {};
  });
}

}  // extern "C"
