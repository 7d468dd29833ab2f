#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <utility>
#include <variant>

#include <lightwell/files.hpp>
#include <lightwell/probe.hpp>

#include "core/descriptor_receiver.hpp"
#include "core/source.hpp"
#include "core/uri.hpp"

namespace lightwell {

namespace {

/// What stands before an error of a link, and after that of a probe that does not respond.
struct ErrorText {
  std::string before, after;
};

ErrorText error_text(std::string_view, const core::ReplayPath&) { return {}; }
ErrorText error_text(std::string_view, const MqttAddress& broker) { return {broker.uri() + ": ", {}}; }
ErrorText error_text(std::string_view uri, const core::UsbAddress&) {
  // `usb:` ends with a colon already.
  return {std::string(uri) + (uri.ends_with(':') ? " " : ": "),
          "; is the probe plugged in with a cable that carries data, and does its configuration have usb_gadget?"};
}
ErrorText error_text(std::string_view uri, const core::GrpcAddress& address) {
  return {
      std::string(uri) + ": ",
      address.transport == core::Transport::tls
          ? "; is lightwelld running there with grpc.security, and was it paired (`lightwell pair`)? A probe that "
            "requires client certificates (LINK_SECURITY_MUTUAL_TLS) closes the connection if this client's is "
            "missing, expired or of another authority"
          : "; is lightwelld running there, and is its grpc.listen_address an address that this machine can reach?"};
}

ErrorText error_text(std::string_view uri, const core::WebAddress& address) {
  return {std::string(uri) + ": ",
          address.transport == core::Transport::tls
              ? "; is lightwelld running there with web.security, and was it paired (`lightwell pair`)?"
              : "; is lightwelld running there with `web` (--web), at an address that this machine can reach?"};
}

}  // namespace

std::string_view version() { return LIGHTWELL_VERSION; }

Status ProbeOptions::validate() const {
  if (max_age.ns <= 0) return invalid_argument("ProbeOptions: max_age must be above zero");
  if (history < 1 || history > 4096) return invalid_argument("ProbeOptions: history must be 1 to 4096");
  if (extrapolation.ns < 0 || extrapolation > Duration::from_seconds(1))
    return invalid_argument("ProbeOptions: extrapolation must be 0 to 1 s");
  if (connect_timeout.ns <= 0) return invalid_argument("ProbeOptions: connect_timeout must be above zero");
  if (retry_min.ns <= 0) return invalid_argument("ProbeOptions: retry_min must be above zero");
  if (retry_max < retry_min) return invalid_argument("ProbeOptions: retry_max must not be below retry_min");
  if (silence_limit < Duration::from_seconds(2))
    return invalid_argument(
        "ProbeOptions: silence_limit must be 2 s or more, because the probe's clock is requested once a second");
  if (T_world_probe) {
    const Quat q = T_world_probe->pose.rotation;
    const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (!(squared > 0) || !std::isfinite(squared))
      return invalid_argument("ProbeOptions: T_world_probe's rotation must not be zero and must be finite");
  }
  if (Status s = credentials.validate(); !s.ok()) return s;
  return mqtt.validate();
}

Status MqttCredentials::validate() const {
  if (certificate_file.empty() != key_file.empty())
    return invalid_argument("MqttCredentials: certificate_file and key_file must be given together or not at all");
  if (user.empty() && !password.empty()) return invalid_argument("MqttCredentials: a password without a user");
  for (const auto& [field, path] :
       {std::pair{"ca_file", &ca_file}, {"certificate_file", &certificate_file}, {"key_file", &key_file}})
    if (!path->empty() && !std::ifstream(*path).good())
      return {StatusCode::not_found, "MqttCredentials: " + std::string(field) + ": " + *path + " cannot be read"};
  return {};
}

bool ProbeCredentials::empty() const {
  return folder.empty() && pinned.empty() && ca.empty() && client_certificate.empty() && client_key.empty() &&
         token.empty();
}

Status ProbeCredentials::validate() const {
  if (empty()) return {};
  const bool more =
      !pinned.empty() || !ca.empty() || !client_certificate.empty() || !client_key.empty() || !token.empty();
  if (!folder.empty())
    return more ? invalid_argument("ProbeCredentials: folder replaces all other fields; leave them empty") : Status();
  if (pinned.empty() == ca.empty())
    return invalid_argument("ProbeCredentials: exactly one of pinned and ca must be set");
  for (const auto& [pem, name] :
       {std::pair(&pinned, "pinned"), std::pair(&ca, "ca"), std::pair(&client_certificate, "client_certificate")})
    if (!pem->empty() && pem->find("-----BEGIN CERTIFICATE-----") == std::string::npos)
      return invalid_argument("ProbeCredentials: " + std::string(name) + " is not a certificate in PEM form");
  if (client_certificate.empty() != client_key.empty())
    return invalid_argument("ProbeCredentials: client_certificate and client_key must be given together");
  if (std::any_of(token.begin(), token.end(), [](char c) { return c <= ' ' || c > '~'; }))
    return invalid_argument("ProbeCredentials: token has a space or a character that is not ASCII");
  return {};
}

std::string default_credential_store() {
  const std::string folder = configuration_folder();
  return folder.empty() ? std::string() : folder + "/lightwell/probes";
}

struct Probe::Impl {
  explicit Impl(const ProbeOptions& options) : receiver(options), T_world_probe(options.T_world_probe) {}
  core::DescriptorReceiver receiver;
  const std::optional<UncertainPose> T_world_probe;
  std::unique_ptr<core::Source> source;  // after the receiver, so that its thread is joined first
};

Probe::Probe(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Probe::Probe(Probe&&) noexcept = default;
Probe& Probe::operator=(Probe&&) noexcept = default;
Probe::~Probe() = default;

Result<Probe> Probe::connect(std::string_view uri, ProbeOptions options) {
  if (Status status = options.validate(); !status.ok()) return status;
  const Result<core::ProbeUri> where = core::parse_probe_uri(uri);
  if (!where.ok()) return where.status();

  auto impl = std::make_unique<Impl>(options);
  Result<std::unique_ptr<core::Source>> source =
      std::visit([&](const auto& address) { return core::make_source(address, options, impl->receiver); }, *where);
  const auto [before, after] = std::visit([&](const auto& address) { return error_text(uri, address); }, *where);
  if (!source.ok()) return Status(source.status().code(), before + source.status().message());
  impl->source = std::move(*source);
  if (const Status s = impl->receiver.wait_until_described(options.connect_timeout); !s.ok())
    return Status(s.code(), before + s.message() + after);
  return Probe(std::move(impl));
}

Lighting Probe::latest() const { return impl_->receiver.latest({monotonic_now_ns()}); }
Lighting Probe::latest_in_world() const {
  const Lighting light = latest();
  const UncertainPose* T_world_probe = impl_->T_world_probe ? &*impl_->T_world_probe : light.mounting();
  // Before the first descriptor, that is the reason, whether or not the pose is known.
  const Validity none = light.validity() == Validity::none ? Validity::none : Validity::invalid_query;
  if (none == Validity::none || T_world_probe == nullptr) return {nullptr, none, {}, Lighting::kDefaultMaxAge};
  return light.in_world(*T_world_probe);
}
Lighting Probe::at(HostTime time) const { return impl_->receiver.at(time); }
PlaneAppearance Probe::plane() const { return impl_->receiver.plane({monotonic_now_ns()}); }

Result<Lighting> Probe::wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const {
  if (Status status = impl_->receiver.wait_for_next(seen, timeout); !status.ok()) return status;
  return latest();
}

ProbeInfo Probe::info() const { return impl_->receiver.info(); }
LinkStats Probe::stats() const { return impl_->receiver.stats(); }

Result<EstimatorConfig> Probe::estimator_config() const {
  const Result<EstimatorState> state = impl_->source->estimator();
  return state ? Result<EstimatorConfig>(state->config) : state.status();
}

Result<EstimatorKind> Probe::estimator_kind() const {
  const Result<EstimatorState> state = impl_->source->estimator();
  return state ? Result<EstimatorKind>(state->kind) : state.status();
}

Status Probe::change_estimator(const EstimatorUpdate& fields) {
  if (fields == EstimatorUpdate{}) return {StatusCode::invalid_argument, "change_estimator: no field is set"};
  // Limits of fields are independent, so the fields without a value can have any.
  if (Status status = updated({}, fields).validate(); !status.ok()) return status;
  return impl_->source->change_estimator(fields);
}

Status Probe::set_estimator(const EstimatorConfig& config) { return change_estimator(all_fields(config)); }

Result<double> Probe::report_lux(double lux, Vec3f normal) {
  if (!(lux > 0) || !(lux < 1e9))
    return Status(StatusCode::invalid_argument, "report_lux: lux must be above zero, below 1e9");
  const Vec3f unit = normalized(normal);
  if (unit == Vec3f{}) return Status(StatusCode::invalid_argument, "report_lux: the normal is zero or not finite");
  return impl_->source->report_lux(lux, unit);
}

Result<CalibrationSummary> Probe::calibration() const { return impl_->source->calibration(); }

Result<RecordingStatus> Probe::start_recording() { return impl_->source->control_recording(RecordingAction::start); }
Result<RecordingStatus> Probe::stop_recording() { return impl_->source->control_recording(RecordingAction::stop); }

}  // namespace lightwell
