#include <algorithm>
#include <cmath>
#include <filesystem>

#include <lightwell/config.hpp>

#include "messages.hpp"
#include "text_message.hpp"

namespace lightwell {

EstimatorConfig config_for_setting(EstimatorConfig config) {
  const bool fast = config.setting == Setting::fast || config.setting == Setting::fastest;
  const double wider = fast ? 2 : config.setting == Setting::exact ? 0 : 1;
  config.panorama.epsilon *= wider;
  config.panorama.radiance_epsilon *= wider;
  if (config.setting == Setting::fastest) config.panorama.interleave = kMaxInterleave;
  return config;
}

Result<MqttAddress> MqttConfig::address() const {
  const auto bad = [](const std::string& what) { return invalid_argument("mqtt." + what); };
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
  const auto bad = [](const std::string& what) { return invalid_argument("mqtt." + what); };
  const Result<MqttAddress> address = this->address();
  if (!address) return address.status();
  if (certificate_file.empty() != key_file.empty())
    return bad("certificate_file and key_file must be given together or not at all");
  if (address->transport == MqttTransport::plain && !(ca_file.empty() && certificate_file.empty()))
    return bad("ca_file and certificate_file have no meaning without TLS: write mqtts://, or leave them out");
  if (client_id.size() > 128) return bad("client_id is longer than 128 bytes");
  return {};
}

Status CaptureSettings::validate() const {
  constexpr double kMinWhiteBalance_k = 1000, kMaxWhiteBalance_k = 20'000;
  const auto bad = [](const std::string& name, const std::string& field, const std::string& what) {
    return invalid_argument(name + ": " + what + " (camera." + field + ", or " + name + "= in the camera's URI)");
  };
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  if (exposure_s.size() > kMaxExposures)
    return bad("exposure", "exposure_s", "a bracket has 1 to 8 exposures, not " + std::to_string(exposure_s.size()));
  for (const double e : exposure_s)
    if (!positive(e)) return bad("exposure", "exposure_s", std::to_string(e) + " is not above zero, in seconds");
  if (gain && !positive(*gain)) return bad("gain", "gain", std::to_string(*gain) + " is not above zero");
  if (white_balance_k && !(*white_balance_k >= kMinWhiteBalance_k && *white_balance_k <= kMaxWhiteBalance_k))
    return bad("white_balance", "white_balance_k",
               std::to_string(*white_balance_k) + " does not lie between 1000 and 20000 K");
  if (colour_gains && !(positive((*colour_gains)[0]) && positive((*colour_gains)[1])))
    return bad("colour_gains", "colour_gains", "there must be two gains above zero, of red and blue");
  return {};
}

Status Config::validate() const {
  if (probe_name.empty() || probe_name.size() > 64) return invalid_argument("probe_name must have 1 to 64 characters");
  if (camera.uri.empty())
    return invalid_argument("camera.uri is missing: give the source of frames, for example \"sim:city\"");
  if (camera.width < 16 || camera.height < 16 || camera.width > 16384 || camera.height > 16384)
    return invalid_argument("camera size is " + std::to_string(camera.width) + "x" + std::to_string(camera.height) +
                            "; each of them must be 16 to 16384 pixels");
  if (!(camera.frame_rate >= 0) || camera.frame_rate > 1000)
    return invalid_argument("camera.frame_rate must be 0 (as fast as possible) to 1000 per second");
  if (const Status s = camera.capture.validate(); !s.ok()) return s;
  if (!(budget_ms >= 0) || !std::isfinite(budget_ms))
    return invalid_argument("budget_ms must be milliseconds an estimate may take, or 0 for no budget");
  if (!(max_bound >= 0 && max_bound < 1))
    return invalid_argument("max_bound must be a relative error below 1, 0.02 is 2 %, or 0 for none");
  if (estimator_kind == EstimatorKind::marker && !marker)
    return invalid_argument(
        "--estimator marker needs a body: name its file with --body or marker.body_file; lightwell-calibrate "
        "marker-sheet creates one, and the sheet to print");
  if (marker && marker->body_file.empty())
    return invalid_argument(
        "marker.body_file is missing: give the path of a file that lightwell-calibrate marker-sheet wrote");
  if (estimator_kind == EstimatorKind::specular && !plane)
    return invalid_argument(
        "--estimator specular needs a plane: name its file with --plane or plane.plane_file (proto/lightwell/v1/"
        "glossy_plane.proto describes it)");
  if (plane && plane->plane_file.empty())
    return invalid_argument("plane.plane_file is missing: give the path of a GlossyPlane");
  if (plane && marker) return invalid_argument("plane cannot be combined with marker; leave one of them out");
  if (plane && grey_patch) return invalid_argument("grey_patch cannot be combined with plane; leave one of them out");
  if (marker && grey_patch)
    return invalid_argument(
        "grey_patch cannot be combined with marker, whose own albedo is known; leave one of them out");
  if (mqtt)
    if (Status s = mqtt->validate(); !s.ok()) return s;
  if (mdns < Mdns::off || mdns > Mdns::on) return invalid_argument("discovery.mdns is not known");
  if (const Status s = grpc.validate(); !s.ok()) return s;
  if (web)
    if (const Status s = web->validate(); !s.ok()) return s;
  if (recordings)
    if (const Status s = recordings->validate(); !s.ok()) return s;
  return estimator.validate();
}

ImageRecipients Config::texture_recipients() const { return plane ? std::max(images, plane->images) : images; }

GrpcConfig Config::web_keys() const {
  GrpcConfig out = grpc;
  if (!web) return out;
  out.security = web->security;
  if (!web->certificate.empty()) {
    out.certificate = web->certificate;
    out.key = web->key;
  }
  if (!web->client_ca.empty()) out.client_ca = web->client_ca;
  return out;
}

namespace {

/// Whether `text` is SCHEME://HOST or SCHEME://HOST:PORT, as browsers write an origin.
bool is_origin(std::string_view text) {
  const std::size_t separator = text.find("://");
  if (separator == std::string_view::npos) return false;
  const std::string_view scheme = text.substr(0, separator), host = text.substr(separator + 3);
  if (scheme != "http" && scheme != "https") return false;
  return !host.empty() && host.find_first_of("/?#@ ,") == std::string_view::npos;
}

/// GrpcConfig::check_bind_policy() of the message `name` of the configuration.
Status check_plain_text(const std::string& listen_address, LinkSecurity security, const std::string& name,
                        const std::string& options) {
  std::string_view host = std::string_view(listen_address).substr(0, listen_address.rfind(':'));
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  if (security != LinkSecurity::unspecified || is_loopback_host(host)) return {};
  return {StatusCode::failed_precondition,
          "listening on '" + listen_address +
              "' in plain text would let everyone on the network watch and command this probe: set " + name +
              ".security to LINK_SECURITY_TLS or LINK_SECURITY_MUTUAL_TLS (" + options +
              " tls) and pair the clients with `lightwelld --pair`; or, on a network that you trust, to "
              "LINK_SECURITY_PLAIN (" +
              options + " plain); or listen on 127.0.0.1"};
}

}  // namespace

Status WebConfig::validate() const {
  if (security > LinkSecurity::mutual_tls) return invalid_argument("web.security is not known");
  if (certificate.empty() != key.empty())
    return invalid_argument("web.certificate and web.key belong together: name both files, or neither");
  if (!encrypted() && (!certificate.empty() || !client_ca.empty()))
    return invalid_argument(
        "web.certificate, web.key and web.client_ca need web.security: LINK_SECURITY_TLS or LINK_SECURITY_MUTUAL_TLS");
  if (dashboard < Dashboard::off || dashboard > Dashboard::on) return invalid_argument("web.dashboard is not known");
  if (allowed_origins.size() > kMaxAllowedOrigins)
    return invalid_argument("web.allowed_origins has " + std::to_string(allowed_origins.size()) +
                            " entries; at most 16 are allowed");
  for (const std::string& origin : allowed_origins)
    if (!is_origin(origin))
      return invalid_argument("web.allowed_origins: '" + origin +
                              "' is not an origin; write https://HOST or https://HOST:PORT, without a path");
  return {};
}

Status RecordingsConfig::validate() const {
  if (folder.empty())
    return invalid_argument("recordings.folder is missing: name a folder in which lightwelld may write");
  if (max_files > kMaxFiles)
    return invalid_argument("recordings.max_files is " + std::to_string(max_files) + "; it must be 1 to 10000");
  return {};
}

Status WebConfig::check_bind_policy() const {
  return check_plain_text(listen_address, security, "web", "--web-security");
}

Status GrpcConfig::validate() const {
  if (security > LinkSecurity::mutual_tls) return invalid_argument("grpc.security is not known");
  if (certificate.empty() != key.empty())
    return invalid_argument(
        "grpc.certificate and grpc.key belong together: name both files, or neither to let the probe make its own");
  if (!encrypted() && (!certificate.empty() || !client_ca.empty()))
    return invalid_argument(
        "grpc.certificate, grpc.key and grpc.client_ca need grpc.security: LINK_SECURITY_TLS or "
        "LINK_SECURITY_MUTUAL_TLS");
  if (client_certificate_days < 1 || client_certificate_days > 7300)
    return invalid_argument("grpc.client_certificate_days is " + std::to_string(client_certificate_days) +
                            "; it must be 1 to 7300");
  return {};
}

Status GrpcConfig::check_bind_policy() const {
  return check_plain_text(listen_address, security, "grpc", "--security");
}

Status GreyPatch::validate(const RigParameters& rig) const {
  const auto wrong = [](const std::string& what) { return invalid_argument("grey_patch: " + what); };
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

Result<CaptureSettings> capture_of(const v1::CameraConfig& m) {
  CaptureSettings out;
  out.exposure_s.assign(m.exposure_s().begin(), m.exposure_s().end());
  if (m.gain() != 0) out.gain = m.gain();
  if (m.white_balance_k() != 0) out.white_balance_k = m.white_balance_k();
  if (m.colour_gains_size() != 0 && m.colour_gains_size() != 2)
    return invalid_argument("camera.colour_gains must be two numbers: red, blue");
  if (m.colour_gains_size() == 2) out.colour_gains = std::array<double, 2>{m.colour_gains(0), m.colour_gains(1)};
  return out;
}

GrpcConfig grpc_of(const v1::GrpcConfig& m) {
  GrpcConfig out;
  if (!m.listen_address().empty()) out.listen_address = m.listen_address();
  out.security = static_cast<LinkSecurity>(m.security());
  out.key_folder = m.key_folder();
  out.certificate = m.certificate();
  out.key = m.key();
  out.client_ca = m.client_ca();
  if (m.client_certificate_days() != 0)
    out.client_certificate_days = static_cast<int>(std::min(m.client_certificate_days(), 1'000'000U));
  return out;
}

Result<GreyPatch> grey_patch_of(const v1::GreyPatch& m) {
  GreyPatch out{static_cast<int>(m.lens()), static_cast<int>(m.x()), static_cast<int>(m.y()),
                static_cast<int>(m.width()), static_cast<int>(m.height())};
  if (m.normal_size() != 0 && m.normal_size() != 3)
    return invalid_argument("grey_patch.normal must be three numbers: x, y, z");
  if (m.normal_size() == 3) out.normal = {m.normal(0), m.normal(1), m.normal(2)};
  if (m.albedo() != 0) out.albedo = m.albedo();
  return out;
}

Result<ImageRecipients> recipients_of(v1::ImageRecipients m, const std::string& field) {
  if (!v1::ImageRecipients_IsValid(m))
    return invalid_argument(field + " is not known: write IMAGE_RECIPIENTS_NOBODY or IMAGE_RECIPIENTS_ALL_CLIENTS");
  return m == v1::IMAGE_RECIPIENTS_ALL_CLIENTS ? ImageRecipients::all_clients : ImageRecipients::nobody;
}

/// Reads `images` and the deprecated plane.images, which counts only without `images`: it was consent to the texture
/// alone, and does not become consent to other pictures.
Status read_images(const v1::Config& m, const std::string& name, Config& out) {
  if (const Status s = recipients_of(m.images(), "images").assign_to(out.images); !s.ok()) return s;
  ImageRecipients of_texture = ImageRecipients::nobody;
  if (const Status s = recipients_of(m.plane().images(), "plane.images").assign_to(of_texture); !s.ok()) return s;
  if (m.plane().images() == v1::IMAGE_RECIPIENTS_UNSPECIFIED) return {};
  if (m.images() == v1::IMAGE_RECIPIENTS_UNSPECIFIED) out.plane->images = of_texture;
  out.warnings.push_back(name +
                         ": plane.images is deprecated and concerns the texture alone; write `images` outside of "
                         "`plane`, which concerns all pictures");
  return {};
}

MqttConfig mqtt_of(const v1::MqttConfig& m) {
  return {m.uri(),
          m.ca_file(),
          m.certificate_file(),
          m.key_file(),
          m.login_file(),
          m.client_id(),
          static_cast<LinkSecurity>(m.security())};
}

WebConfig web_of(const v1::WebConfig& m) {
  WebConfig out;
  if (!m.listen_address().empty()) out.listen_address = m.listen_address();
  out.security = static_cast<LinkSecurity>(m.security());
  out.certificate = m.certificate();
  out.key = m.key();
  out.client_ca = m.client_ca();
  if (m.dashboard() != 0) out.dashboard = static_cast<Dashboard>(m.dashboard());
  out.allowed_origins.assign(m.allowed_origins().begin(), m.allowed_origins().end());
  return out;
}

RecordingsConfig recordings_of(const v1::RecordingsConfig& m) {
  RecordingsConfig out{m.folder()};
  if (m.max_bytes() != 0) out.max_bytes = m.max_bytes();
  if (m.max_files() != 0) out.max_files = m.max_files();
  if (m.min_free_bytes() != 0) out.min_free_bytes = m.min_free_bytes();
  return out;
}

/// The paths that are relative to the configuration's folder.
std::vector<std::string*> paths_of(Config& c) {
  std::vector<std::string*> paths = {&c.calibration,      &c.mounting, &c.grpc.key_folder,
                                     &c.grpc.certificate, &c.grpc.key, &c.grpc.client_ca};
  if (c.marker) paths.push_back(&c.marker->body_file);
  if (c.plane) paths.push_back(&c.plane->plane_file);
  if (c.mqtt)
    paths.insert(paths.end(), {&c.mqtt->ca_file, &c.mqtt->certificate_file, &c.mqtt->key_file, &c.mqtt->login_file});
  if (c.web) paths.insert(paths.end(), {&c.web->certificate, &c.web->key, &c.web->client_ca});
  if (c.recordings) paths.push_back(&c.recordings->folder);
  return paths;
}

}  // namespace

Result<Config> parse_config(std::string_view text, const std::string& name, const std::string& camera_uri,
                            std::optional<EstimatorKind> estimator) {
  v1::Config m;
  Config c;
  if (const Status s = parse_text_message(text, name, m, &c.warnings); !s.ok()) return s;
  if (!m.probe_name().empty()) c.probe_name = m.probe_name();
  c.camera.uri = camera_uri.empty() ? m.camera().uri() : camera_uri;
  if (m.camera().width() != 0) c.camera.width = static_cast<int>(m.camera().width());
  if (m.camera().height() != 0) c.camera.height = static_cast<int>(m.camera().height());
  if (m.camera().frame_rate() != 0) c.camera.frame_rate = m.camera().frame_rate();
  if (const Status s = capture_of(m.camera()).assign_to(c.camera.capture); !s.ok()) return s.in(name);
  c.calibration = m.calibration();
  c.mounting = m.mounting();
  const EstimatorKind kind = estimator.value_or(m.has_marker()  ? EstimatorKind::marker
                                                : m.has_plane() ? EstimatorKind::specular
                                                                : EstimatorKind::panorama);
  const ReceivedUpdate set = update_of(m.estimator(), kind);
  for (const std::string& warning : set.warnings) c.warnings.push_back(name + ": " + warning);
  c.estimator = updated({}, set.update);
  c.grpc = grpc_of(m.grpc());
  c.record_path = m.record().path();
  c.budget_ms = m.budget_ms();
  c.max_bound = m.max_bound();
  if (m.has_grey_patch())
    if (const Status s = grey_patch_of(m.grey_patch()).assign_to(c.grey_patch); !s.ok()) return s.in(name);
  if (m.has_marker()) c.marker = MarkerConfig{m.marker().body_file()};
  if (m.has_plane()) c.plane = PlaneConfig{m.plane().plane_file()};
  if (const Status s = read_images(m, name, c); !s.ok()) return s.in(name);
  if (m.has_usb_gadget()) {
    c.usb_gadget.emplace();
    if (!m.usb_gadget().functionfs_mount().empty()) c.usb_gadget->functionfs_mount = m.usb_gadget().functionfs_mount();
  }
  if (m.has_mqtt()) c.mqtt = mqtt_of(m.mqtt());
  if (m.has_web()) c.web = web_of(m.web());
  if (m.has_recordings()) c.recordings = recordings_of(m.recordings());
  if (m.discovery().mdns() != 0) c.mdns = static_cast<Mdns>(m.discovery().mdns());
  if (const Status s = c.validate(); !s.ok()) return s.in(name);
  if (const Status s = c.estimator.validate(kind); !s.ok()) return s.in(name);
  // After validate(), because the command line may still name the marker's body.
  c.estimator_kind = kind;
  return c;
}

Result<Config> load_config(const std::string& path, const std::string& camera_uri,
                           std::optional<EstimatorKind> estimator) {
  Result<Config> config = load_text(path, [&](std::string_view text, const std::string& name) {
    return parse_config(text, name, camera_uri, estimator);
  });
  if (!config) return config;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  for (std::string* file : paths_of(*config))
    if (!file->empty()) *file = (folder / *file).string();
  return config;
}

}  // namespace lightwell
