#include <algorithm>
#include <cmath>

#include <lightwell/config.hpp>
#include <lightwell/mqtt.hpp>

#include "lightwell/v1/config.pb.h"
#include "text_message.hpp"

namespace lightwell {

Status EstimatorConfig::validate() const {
  if (band < 0 || band > 6)
    return {StatusCode::invalid_argument, "estimator.band is " + std::to_string(band) + "; it must be 0 to 6"};
  if (max_lights < 0 || max_lights > 64)
    return {StatusCode::invalid_argument,
            "estimator.max_lights is " + std::to_string(max_lights) + "; it must be 0 to 64"};
  if (!(light_threshold >= 1.5) || !std::isfinite(light_threshold))
    return {StatusCode::invalid_argument, "estimator.light_threshold is " + std::to_string(light_threshold) +
                                              "; it must be at least 1.5 times the mean"};
  if (!(epsilon >= 0 && epsilon < 1))
    return {StatusCode::invalid_argument,
            "estimator.epsilon is " + std::to_string(epsilon) + "; it must be 0 to 1, 0.01 is 1 %"};
  if (!(radiance_epsilon >= 0 && radiance_epsilon < 1))
    return {StatusCode::invalid_argument,
            "estimator.radiance_epsilon is " + std::to_string(radiance_epsilon) + "; it must be 0 to 1, 0.01 is 1 %"};
  if (to_string(setting) == "unknown") return {StatusCode::invalid_argument, "estimator.setting is not known"};
  if (unseen < UnseenFill::none || unseen > UnseenFill::average)
    return {StatusCode::invalid_argument, "estimator.unseen is not known"};
  if (smoothing < Smoothing::none || smoothing > Smoothing::one_euro)
    return {StatusCode::invalid_argument, "estimator.smoothing is not known"};
  if (environment_edge != 0 && environment_edge != 8 && environment_edge != 16 && environment_edge != 32 &&
      environment_edge != 64)
    return {StatusCode::invalid_argument,
            "estimator.environment_edge is " + std::to_string(environment_edge) + "; it must be 0, 8, 16, 32 or 64"};
  if (!(environment_rate > 0) || !std::isfinite(environment_rate))
    return {StatusCode::invalid_argument, "estimator.environment_rate must be positive and finite"};
  return {};
}

EstimatorConfig at_setting(EstimatorConfig config) {
  double wider = 1;
  switch (config.setting) {
    case Setting::fast:
      wider = 2;
      break;
    case Setting::balanced:
      break;
    case Setting::exact:
      wider = 0;
      break;
  }
  config.epsilon *= wider;
  config.radiance_epsilon *= wider;
  return config;
}

Status MqttConfig::validate() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, "mqtt." + what); };
  const Result<MqttAddress> address = parse_mqtt_address(uri);
  if (!address) return bad("uri: " + address.status().message());
  if (certificate_file.empty() != key_file.empty())
    return bad("certificate_file and key_file come together or not at all");
  if (address->transport == MqttTransport::plain && !(ca_file.empty() && certificate_file.empty()))
    return bad("ca_file and certificate_file have no meaning without TLS: write mqtts://, or leave them out");
  if (client_id.size() > 128) return bad("client_id is longer than 128 bytes");
  return {};
}

Status Config::validate() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  if (probe_name.empty() || probe_name.size() > 64) return bad("probe_name must have 1 to 64 characters");
  if (camera.uri.empty()) return bad("camera.uri is missing: say where frames come from, for example \"sim:city\"");
  if (camera.width < 16 || camera.height < 16 || camera.width > 16384 || camera.height > 16384)
    return bad("camera size is " + std::to_string(camera.width) + "x" + std::to_string(camera.height) +
               "; each side must be 16 to 16384 pixels");
  if (!(camera.frame_rate >= 0) || camera.frame_rate > 1000)
    return bad("camera.frame_rate must be 0 (as fast as frames come) to 1000 per second");
  if (camera.exposure_s.size() > 8) return bad("camera.exposure_s: a bracket has at most 8 exposures");
  for (const double e : camera.exposure_s)
    if (!(e > 0) || !std::isfinite(e)) return bad("camera.exposure_s must be positive and finite, in seconds");
  if (!(camera.gain > 0) || !std::isfinite(camera.gain)) return bad("camera.gain must be positive and finite");
  if (!(budget_ms >= 0) || !std::isfinite(budget_ms))
    return bad("budget_ms must be milliseconds an estimate may take, or 0 for no budget");
  if (marker && marker->body.empty())
    return bad("marker.body is missing: name a body's file, as lightwell-calibrate marker-sheet wrote it");
  if (marker && grey_patch) return bad("grey_patch has no meaning beside marker: the marker's own paper is known");
  if (mqtt)
    if (Status s = mqtt->validate(); !s.ok()) return s;
  if (mdns < Mdns::off || mdns > Mdns::on) return bad("discovery.mdns is not known");
  if (const Status s = grpc.validate(); !s.ok()) return s;
  return estimator.validate();
}

Status GrpcConfig::validate() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  if (security > LinkSecurity::mutual_tls) return bad("grpc.security is not known");
  if (certificate.empty() != key.empty())
    return bad(
        "grpc.certificate and grpc.key belong together: name both files, or neither to let the probe make its own");
  if (!encrypted() && (!certificate.empty() || !client_ca.empty()))
    return bad(
        "grpc.certificate, grpc.key and grpc.client_ca want grpc.security: LINK_SECURITY_TLS or "
        "LINK_SECURITY_MUTUAL_TLS");
  if (paired_days < 1 || paired_days > 7300)
    return bad("grpc.paired_days is " + std::to_string(paired_days) + "; it must be 1 to 7300");
  return {};
}

Status GreyPatch::validate(const RigParameters& rig) const {
  const auto wrong = [](const std::string& what) {
    return Status(StatusCode::invalid_argument, "grey_patch: " + what);
  };
  if (lens < 0 || static_cast<std::size_t>(lens) >= rig.lenses.size())
    return wrong("lens must be 0 to " + std::to_string(rig.lenses.size() - 1) + ", as the calibration has them");
  const LensParameters& l = rig.lenses[static_cast<std::size_t>(lens)];
  if (width < 1 || height < 1 || x < 0 || y < 0 || width > l.width - x || height > l.height - y)
    return wrong("x, y, width and height must lie within the picture");
  const Vec3d n = vec_cast<double>(normal);
  if (!(std::abs(dot(n, n) - 1) < 1e-3)) return wrong("normal must have length one");
  if (!(albedo > 0 && albedo <= 1)) return wrong("albedo must be above 0 and at most 1");
  return {};
}

namespace {

EstimatorConfig updated(EstimatorConfig e, const v1::EstimatorConfig& m) {
  if (m.has_band()) e.band = static_cast<int>(m.band());
  if (m.has_max_lights()) e.max_lights = static_cast<int>(m.max_lights());
  if (m.has_light_threshold()) e.light_threshold = m.light_threshold();
  if (m.has_epsilon()) e.epsilon = m.epsilon();
  if (m.has_radiance_epsilon()) e.radiance_epsilon = m.radiance_epsilon();
  if (m.has_setting()) e.setting = static_cast<Setting>(m.setting());
  if (m.has_unseen()) e.unseen = static_cast<UnseenFill>(m.unseen());
  if (m.has_smoothing()) e.smoothing = static_cast<Smoothing>(m.smoothing());
  if (m.has_environment_edge()) e.environment_edge = static_cast<int>(m.environment_edge());
  if (m.has_environment_rate()) e.environment_rate = m.environment_rate();
  return e;
}

GrpcConfig grpc_of(const v1::GrpcConfig& m) {
  GrpcConfig out;
  if (!m.listen().empty()) out.listen = m.listen();
  out.security = static_cast<LinkSecurity>(m.security());
  out.keys = m.keys();
  out.certificate = m.certificate();
  out.key = m.key();
  out.client_ca = m.client_ca();
  if (m.paired_days() != 0) out.paired_days = static_cast<int>(std::min(m.paired_days(), 1'000'000U));
  return out;
}

Result<GreyPatch> grey_patch_of(const v1::GreyPatch& m) {
  GreyPatch out;
  out.lens = static_cast<int>(m.lens());
  out.x = static_cast<int>(m.x());
  out.y = static_cast<int>(m.y());
  out.width = static_cast<int>(m.width());
  out.height = static_cast<int>(m.height());
  if (m.normal_size() != 0 && m.normal_size() != 3)
    return Status(StatusCode::invalid_argument, "grey_patch.normal must be three numbers: x, y, z");
  if (m.normal_size() == 3) out.normal = {m.normal(0), m.normal(1), m.normal(2)};
  if (m.albedo() != 0) out.albedo = m.albedo();
  return out;
}

MqttConfig mqtt_of(const v1::MqttConfig& m) {
  MqttConfig out;
  out.uri = m.uri();
  out.ca_file = m.ca_file();
  out.certificate_file = m.certificate_file();
  out.key_file = m.key_file();
  out.login_file = m.login_file();
  out.client_id = m.client_id();
  return out;
}

}  // namespace

std::string encode_config(const EstimatorConfig& e) {
  v1::EstimatorConfig m;
  m.set_band(static_cast<std::uint32_t>(e.band));
  m.set_max_lights(static_cast<std::uint32_t>(e.max_lights));
  m.set_light_threshold(e.light_threshold);
  m.set_epsilon(e.epsilon);
  m.set_radiance_epsilon(e.radiance_epsilon);
  m.set_setting(static_cast<v1::Setting>(e.setting));
  m.set_unseen(static_cast<v1::UnseenFill>(e.unseen));
  m.set_smoothing(static_cast<v1::Smoothing>(e.smoothing));
  m.set_environment_edge(static_cast<std::uint32_t>(e.environment_edge));
  m.set_environment_rate(e.environment_rate);
  return m.SerializeAsString();
}

Result<EstimatorConfig> updated_config(const EstimatorConfig& config, std::string_view message) {
  v1::EstimatorConfig m;
  if (!m.ParseFromArray(message.data(), static_cast<int>(message.size())))
    return Status(StatusCode::data_loss, "estimator: not a protobuf message");
  return updated(config, m);
}

Result<Config> parse_config(std::string_view text, const std::string& name, const std::string& camera_uri) {
  v1::Config m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  Config c;
  if (!m.probe_name().empty()) c.probe_name = m.probe_name();
  c.camera.uri = camera_uri.empty() ? m.camera().uri() : camera_uri;
  if (m.camera().width() != 0) c.camera.width = static_cast<int>(m.camera().width());
  if (m.camera().height() != 0) c.camera.height = static_cast<int>(m.camera().height());
  if (m.camera().frame_rate() != 0) c.camera.frame_rate = m.camera().frame_rate();
  c.camera.exposure_s.assign(m.camera().exposure_s().begin(), m.camera().exposure_s().end());
  if (m.camera().gain() != 0) c.camera.gain = m.camera().gain();
  c.calibration = m.calibration();
  c.mounting = m.mounting();
  c.estimator = updated({}, m.estimator());
  c.grpc = grpc_of(m.grpc());
  c.record_path = m.record().path();
  c.budget_ms = m.budget_ms();
  if (m.has_grey_patch()) {
    const Result<GreyPatch> patch = grey_patch_of(m.grey_patch());
    if (!patch) return Status(patch.status().code(), name + ": " + patch.status().message());
    c.grey_patch = *patch;
  }
  if (m.has_marker()) c.marker = MarkerConfig{m.marker().body()};
  if (m.has_usb_gadget()) {
    c.usb_gadget.emplace();
    if (!m.usb_gadget().ffs().empty()) c.usb_gadget->ffs = m.usb_gadget().ffs();
  }
  if (m.has_mqtt()) c.mqtt = mqtt_of(m.mqtt());
  if (m.discovery().mdns() != 0) c.mdns = static_cast<Mdns>(m.discovery().mdns());
  if (const Status s = c.validate(); !s.ok()) return Status(s.code(), name + ": " + s.message());
  return c;
}

Result<Config> load_config(const std::string& path, const std::string& camera_uri) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_config(*text, path, camera_uri);
}

}  // namespace lightwell
