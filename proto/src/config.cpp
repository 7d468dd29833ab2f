#include <algorithm>
#include <array>
#include <cmath>

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/util/message_differencer.h>

#include <lightwell/config.hpp>
#include <lightwell/mqtt.hpp>

#include "config_message.hpp"
#include "text_message.hpp"

namespace lightwell {
namespace {

namespace pb = google::protobuf;

constexpr std::array kKinds = {EstimatorKind::panorama, EstimatorKind::marker};

Status refuse(const std::string& field, const std::string& value, const std::string& what) {
  return {StatusCode::invalid_argument, "estimator." + field + " is " + value + "; it must be " + what};
}

}  // namespace

std::string_view to_string(EstimatorKind kind) {
  switch (kind) {
    case EstimatorKind::panorama:
      return "panorama";
    case EstimatorKind::marker:
      return "marker";
  }
  return "unknown";
}

Status PanoramaEstimatorConfig::validate() const {
  if (!(light_threshold >= 1.5) || !std::isfinite(light_threshold))
    return refuse("panorama.light_threshold", std::to_string(light_threshold), "at least 1.5 times the mean");
  if (!(epsilon >= 0 && epsilon < 1)) return refuse("panorama.epsilon", std::to_string(epsilon), "0 to 1, 0.01 is 1 %");
  if (!(radiance_epsilon >= 0 && radiance_epsilon < 1))
    return refuse("panorama.radiance_epsilon", std::to_string(radiance_epsilon), "0 to 1, 0.01 is 1 %");
  if (unseen < UnseenFill::none || unseen > UnseenFill::average)
    return {StatusCode::invalid_argument, "estimator.panorama.unseen is not known"};
  if (smoothing < Smoothing::none || smoothing > Smoothing::one_euro)
    return {StatusCode::invalid_argument, "estimator.panorama.smoothing is not known"};
  if (environment_edge != 0 && environment_edge != 8 && environment_edge != 16 && environment_edge != 32 &&
      environment_edge != 64)
    return refuse("panorama.environment_edge", std::to_string(environment_edge), "0, 8, 16, 32 or 64");
  if (!(environment_rate > 0) || !std::isfinite(environment_rate))
    return refuse("panorama.environment_rate", std::to_string(environment_rate), "positive and finite");
  return {};
}

Status MarkerEstimatorConfig::validate() const {
  if (!(decimation == 0 || (decimation >= 1 && decimation <= 8)))
    return refuse("marker.decimation", std::to_string(decimation), "0 (from the size of the tags) or 1 to 8");
  if (!(search_decimation >= 1 && search_decimation <= 8))
    return refuse("marker.search_decimation", std::to_string(search_decimation), "1 to 8");
  if (max_faces < 0) return refuse("marker.max_faces", std::to_string(max_faces), "0 (all) or more");
  return {};
}

Status EstimatorConfig::validate() const {
  if (band < 0 || band > 6) return refuse("band", std::to_string(band), "0 to 6");
  if (max_lights < 0 || max_lights > 64) return refuse("max_lights", std::to_string(max_lights), "0 to 64");
  if (to_string(setting) == "unknown") return {StatusCode::invalid_argument, "estimator.setting is not known"};
  if (Status s = panorama.validate(); !s.ok()) return s;
  return marker.validate();
}

Status EstimatorConfig::validate(EstimatorKind kind) const {
  if (Status s = validate(); !s.ok()) return s;
  const std::string name(to_string(kind));
  const v1::EstimatorConfig set = message_of(*this), usual = message_of({});
  const pb::Reflection& fields = *set.GetReflection();
  for (const EstimatorKind other : kKinds) {
    if (other == kind) continue;
    const std::string owner(to_string(other));
    const pb::FieldDescriptor* section = set.GetDescriptor()->FindFieldByName(owner);
    const pb::Message &has = fields.GetMessage(set, section), &had = fields.GetMessage(usual, section);
    pb::util::MessageDifferencer differencer;
    std::vector<const pb::FieldDescriptor*> all;
    has.GetReflection()->ListFields(has, &all);
    for (const pb::FieldDescriptor* field : all)
      if (!differencer.CompareWithFields(has, had, {field}, {field}))
        return {StatusCode::invalid_argument,
                "estimator." + owner + "." + field->name() + ": the " + name +
                    " estimator, which is active, has no such option; the " + owner +
                    " estimator has it: leave it out, or run that estimator (lightwelld --estimator " + owner + ")"};
  }
  const std::span<const Setting> settings = settings_of(kind);
  if (std::ranges::find(settings, setting) == settings.end())
    return {StatusCode::invalid_argument, "estimator.setting: the " + name + " estimator has no setting " +
                                              std::string(to_string(setting)) + "; set " +
                                              std::string(to_string(settings.back()))};
  return {};
}

std::vector<std::string> option_names(EstimatorKind kind) {
  std::vector<std::string> out;
  const pb::Descriptor& all = *v1::EstimatorConfig::descriptor();
  for (int i = 0; i < all.field_count(); ++i) {
    const pb::FieldDescriptor& field = *all.field(i);
    if (const pb::Descriptor* section = field.message_type()) {
      if (field.name() != to_string(kind)) continue;
      for (int k = 0; k < section->field_count(); ++k) out.push_back(field.name() + "." + section->field(k)->name());
    } else if (!field.options().deprecated()) {
      out.push_back(field.name());
    }
  }
  return out;
}

std::span<const Setting> settings_of(EstimatorKind kind) {
  // The options of the marker estimator do not form a single trade-off, so its settings make no difference.
  const std::span<const Setting> all(kSettings);
  return kind == EstimatorKind::marker ? all.subspan(1, 1) : all;
}

EstimatorConfig config_for_setting(EstimatorConfig config) {
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
  config.panorama.epsilon *= wider;
  config.panorama.radiance_epsilon *= wider;
  return config;
}

Result<MqttAddress> MqttConfig::address() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, "mqtt." + what); };
  Result<MqttAddress> out = parse_mqtt_address(uri);
  if (!out) return bad("uri: " + out.status().message());
  const bool tls = out->transport == MqttTransport::tls;
  if (security > LinkSecurity::mutual_tls) return bad("security is not known");
  if (security == LinkSecurity::plain && tls) return bad("security: plain text contradicts mqtts://; leave one out");
  if (security >= LinkSecurity::tls && !tls) return bad("security: TLS needs an address that begins with mqtts://");
  if (security == LinkSecurity::mutual_tls && certificate_file.empty())
    return bad("certificate_file is missing, which LINK_SECURITY_MUTUAL_TLS requires");
  if (security == LinkSecurity::plain) out->plain_login = PlainLogin::allowed;
  if (const Status s = check_plain_login(*out); !login_file.empty() && !s.ok())
    return bad("login_file: " + s.message());
  return out;
}

Status MqttConfig::validate() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, "mqtt." + what); };
  const Result<MqttAddress> address = this->address();
  if (!address) return address.status();
  if (certificate_file.empty() != key_file.empty())
    return bad("certificate_file and key_file must be given together or not at all");
  if (address->transport == MqttTransport::plain && !(ca_file.empty() && certificate_file.empty()))
    return bad("ca_file and certificate_file have no meaning without TLS: write mqtts://, or leave them out");
  if (client_id.size() > 128) return bad("client_id is longer than 128 bytes");
  return {};
}

Status Config::validate() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  if (probe_name.empty() || probe_name.size() > 64) return bad("probe_name must have 1 to 64 characters");
  if (camera.uri.empty()) return bad("camera.uri is missing: give the source of frames, for example \"sim:city\"");
  if (camera.width < 16 || camera.height < 16 || camera.width > 16384 || camera.height > 16384)
    return bad("camera size is " + std::to_string(camera.width) + "x" + std::to_string(camera.height) +
               "; each of them must be 16 to 16384 pixels");
  if (!(camera.frame_rate >= 0) || camera.frame_rate > 1000)
    return bad("camera.frame_rate must be 0 (as fast as possible) to 1000 per second");
  if (camera.exposure_s.size() > 8) return bad("camera.exposure_s: a bracket has at most 8 exposures");
  for (const double e : camera.exposure_s)
    if (!(e > 0) || !std::isfinite(e)) return bad("camera.exposure_s must be positive and finite, in seconds");
  if (!(camera.gain > 0) || !std::isfinite(camera.gain)) return bad("camera.gain must be positive and finite");
  if (!(budget_ms >= 0) || !std::isfinite(budget_ms))
    return bad("budget_ms must be milliseconds an estimate may take, or 0 for no budget");
  if (marker && marker->body.empty())
    return bad("marker.body is missing: give the path of a body file, as written by lightwell-calibrate marker-sheet");
  if (marker && grey_patch)
    return bad("grey_patch cannot be combined with marker, whose own albedo is known; leave one of them out");
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
        "grpc.certificate, grpc.key and grpc.client_ca need grpc.security: LINK_SECURITY_TLS or "
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
  out.security = static_cast<LinkSecurity>(m.security());
  return out;
}

}  // namespace

Result<Config> parse_config(std::string_view text, const std::string& name, const std::string& camera_uri,
                            std::optional<EstimatorKind> estimator) {
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
  const EstimatorKind kind = estimator.value_or(m.has_marker() ? EstimatorKind::marker : EstimatorKind::panorama);
  const ReceivedUpdate set = update_of(m.estimator(), kind);
  for (const std::string& warning : set.warnings) c.warnings.push_back(name + ": " + warning);
  c.estimator = updated({}, set.update);
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
  if (const Status s = c.estimator.validate(kind); !s.ok()) return Status(s.code(), name + ": " + s.message());
  return c;
}

Result<Config> load_config(const std::string& path, const std::string& camera_uri,
                           std::optional<EstimatorKind> estimator) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_config(*text, path, camera_uri, estimator);
}

}  // namespace lightwell
