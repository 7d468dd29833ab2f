#include <cstdlib>
#include <iostream>
#include <istream>
#include <map>
#include <optional>

#include <CLI/CLI.hpp>

#include <lightwell/commands.hpp>
#include <lightwell/config.hpp>

#include "app/component_tables.hpp"
#include "app/daemon.hpp"

namespace {

/// Exit codes: the footer of --help.
enum Exit : int { kOk = 0, kFailed = 1, kUsage = 2 };

struct Size {
  int width = 0, height = 0;
};

/// Reads "1280x960"; CLI11 calls it for options of this type.
std::istream& operator>>(std::istream& in, Size& size) {
  char times = 0;
  in >> size.width >> times >> size.height;
  if (times != 'x' || size.width <= 0 || size.height <= 0) in.setstate(std::ios::failbit);
  return in;
}

const std::map<std::string, lightwell::LinkSecurity> kSecurityNames = {
    {"plain", lightwell::LinkSecurity::plain},
    {"tls", lightwell::LinkSecurity::tls},
    {"mutual-tls", lightwell::LinkSecurity::mutual_tls}};

/// The names of all estimators, also of those that this build lacks.
std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  for (const lightwell::EstimatorKind kind : lightwell::kEstimatorKinds) names.emplace_back(to_string(kind));
  return names;
}

/// "panorama (...) or marker (...)"
std::string estimator_help() {
  std::string help;
  for (const lightwell::EstimatorEntry& entry : lightwell::estimator_table())
    help += std::string(help.empty() ? "" : " or ") + std::string(to_string(entry.kind)) + " (" +
            std::string(entry.source) + ")";
  return help;
}

}  // namespace

int main(int argc, char** argv) {
  lightwell::block_stop_signals();
  // gRPC's own log is off unless the user sets the variable: lightwelld reports errors itself.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  lightwell::silence_protobuf_log();

  CLI::App app{"lightwelld turns a camera's frames into lighting descriptors and serves them to AR applications."};
  app.footer(
      "Examples:\n"
      "  lightwelld --camera sim:city                        a simulated rig in a real place\n"
      "  lightwelld --camera 'sim:night?sensor=rgb8' --exposure-s 0.001 --exposure-s 0.02 --exposure-s 0.4\n"
      "  lightwelld --config /etc/lightwell/probe.textproto  everything from a file\n"
      "  lightwelld --camera v4l2:/dev/video0 --calibration webcam.textproto --estimator marker --body "
      "dodecahedron.textproto\n"
      "  lightwelld --camera sim:city --budget-ms 3          lowers the setting under load, raises it again later\n"
      "  lightwelld --camera sim:city --listen '[::]:7420' --security tls   on the network, for paired clients\n"
      "  lightwelld --pair --listen '[::]:7420' --security tls              in parallel: pairs one client, then ends\n"
      "  lightwelld --camera sim:city --web 127.0.0.1:7443   the dashboard at http://127.0.0.1:7443\n"
      "  lightwell watch grpc://127.0.0.1:7420               shows what a client receives\n"
      "Fields of the file: proto/lightwell/v1/config.proto. Options override the file.\n"
      "Exit status: 0 stopped by a signal or at the end of a recording, 1 could not start, 2 wrong usage.");
  std::string config_path, camera, calibration, estimator, body, plane, mounting, listen, web, mqtt, record, recordings,
      name, keys, pair_listen;
  lightwell::LinkSecurity security = lightwell::LinkSecurity::unspecified, web_security = security;
  Size size;
  double frame_rate = -1;
  double budget_ms = -1, max_bound = -1;
  std::vector<double> exposures;
  bool announce = false, list_cameras = false, check = false, pair = false;
  app.add_option("--config", config_path, "Configuration in protobuf text format");
  app.add_option("--camera", camera, "Where frames come from; --cameras lists the kinds");
  app.add_option("--calibration", calibration, "Calibration in protobuf text format; default: the camera's own");
  app.add_option("--estimator", estimator,
                 "Source of the light: " + estimator_help() +
                     " [marker if a body is named, specular if a plane is, otherwise panorama]")
      ->check(CLI::IsMember(estimator_names()));
  CLI::Option* const plane_option =
      app.add_option("--plane", plane, "The glossy plane (a GlossyPlane, proto/lightwell/v1/glossy_plane.proto)");
  app.add_option("--body", body, "The marker's body, as lightwell-calibrate marker-sheet wrote it")
      ->excludes(plane_option);
  app.add_option("--mounting", mounting,
                 "Pose of the probe in the room, as lightwell-calibrate mounting wrote it; clients receive it");
  app.add_option("--size", size, "Size of one lens's picture, WIDTHxHEIGHT [640x480]");
  app.add_option("--frame-rate", frame_rate, "Frames per second; 0 as fast as they come [30]")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--exposure-s", exposures, "Exposure in seconds; several make a bracket")->allow_extra_args(false);
  app.add_option(
         "--budget-ms", budget_ms,
         "Time limit of an estimate in milliseconds; a cheaper setting than the configured one is used if it takes "
         "longer. 0 for none [0]")
      ->check(CLI::NonNegativeNumber);
  app.add_option(
         "--max-bound", max_bound,
         "Error bound that descriptors shall state, 0.02 is 2 %: the cheapest setting that keeps it is used, up "
         "to the configured one. 0 for none [0]")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--listen", listen,
                 "Address of the gRPC link, HOST:PORT; port 0 means any free port [127.0.0.1:7420]");
  app.add_option(
         "--security", security,
         "plain (no authentication), tls (a token or a certificate), mutual-tls (a certificate) [plain on a loopback "
         "address, required otherwise]")
      ->transform(CLI::CheckedTransformer(kSecurityNames));
  app.add_option("--web", web,
                 "Serve browsers, too: address of the link by WebSocket and HTTP, with the dashboard, HOST:PORT "
                 "[with `web` in the file: 127.0.0.1:7443]");
  app.add_option("--web-security", web_security, "As --security, for --web")
      ->transform(CLI::CheckedTransformer(kSecurityNames));
  app.add_option("--keys", keys, "Folder of the probe's keys and of the list of its clients [the state folder]");
  app.add_flag(
      "--pair", pair,
      "Pair one client: show a code, wait two minutes, exit. The probe itself may be running at the same time");
  app.add_option("--pair-listen", pair_listen, "Address for pairing, HOST:PORT [the host of --listen, port 7421]");
  app.add_option("--mqtt", mqtt,
                 "Publish at an MQTT broker, too: mqtt://BROKER:1883/venue/probe; files for TLS: --config");
  app.add_flag("--announce", announce, "Let `lightwell discover` find this probe (mDNS)");
  app.add_option("--record", record, "Record frames with metadata to this file");
  app.add_option("--recordings", recordings,
                 "Let clients record descriptors in this folder of the probe (lightwell recording start)");
  app.add_option("--name", name, "Name of the probe [lightwell]");
  app.add_flag("--cameras", list_cameras, "List the camera backends of this build and exit");
  app.add_flag("--check", check, "Check configuration, camera and calibration, and exit");
  app.set_version_flag("--version", std::string(lightwell::kFirmwareVersion));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }

  if (list_cameras) {
    for (const lightwell::BackendEntry& entry : lightwell::backend_table()) std::cout << entry.help << "\n";
    return kOk;
  }
  lightwell::Config config;
  std::optional<lightwell::EstimatorKind> kind;
  if (!body.empty()) kind = lightwell::EstimatorKind::marker;
  if (!plane.empty()) kind = lightwell::EstimatorKind::specular;
  for (const lightwell::EstimatorKind k : lightwell::kEstimatorKinds)
    if (to_string(k) == estimator) kind = k;
  if (!config_path.empty()) {
    lightwell::Result<lightwell::Config> loaded =
        lightwell::load_config(config_path, pair && camera.empty() ? "none" : camera, kind);
    if (!loaded) {
      lightwell::log_error(loaded.status().message());
      return kFailed;
    }
    config = std::move(*loaded);
    for (const std::string& warning : config.warnings) lightwell::log_info(warning);
  }
  if (!camera.empty()) config.camera.uri = camera;
  if (!calibration.empty()) config.calibration = calibration;
  if (kind) config.estimator_kind = *kind;
  if (!body.empty()) config.marker = lightwell::MarkerConfig{body};
  if (config.estimator_kind != lightwell::EstimatorKind::marker) config.marker.reset();
  if (!plane.empty()) {
    if (!config.plane) config.plane.emplace();
    config.plane->plane_file = plane;
  }
  if (config.estimator_kind != lightwell::EstimatorKind::specular) config.plane.reset();
  if (!mounting.empty()) config.mounting = mounting;
  if (size.width != 0) {
    config.camera.width = size.width;
    config.camera.height = size.height;
  }
  if (frame_rate >= 0) config.camera.frame_rate = frame_rate;
  if (!exposures.empty()) config.camera.capture.exposure_s = exposures;
  if (budget_ms >= 0) config.budget_ms = budget_ms;
  if (max_bound >= 0) config.max_bound = max_bound;
  if (!listen.empty()) config.grpc.listen_address = listen;
  if (security != lightwell::LinkSecurity::unspecified) config.grpc.security = security;
  if (!keys.empty()) config.grpc.key_folder = keys;
  if ((!web.empty() || web_security != lightwell::LinkSecurity::unspecified) && !config.web) config.web.emplace();
  if (!web.empty()) config.web->listen_address = web;
  if (web_security != lightwell::LinkSecurity::unspecified) config.web->security = web_security;
  if (!mqtt.empty() && !config.mqtt) config.mqtt.emplace();
  if (!mqtt.empty()) config.mqtt->uri = mqtt;
  if (announce) config.mdns = lightwell::Mdns::on;
  if (!record.empty()) config.record_path = record;
  if (!recordings.empty() && !config.recordings) config.recordings.emplace();
  if (!recordings.empty()) config.recordings->folder = recordings;
  if (!name.empty()) config.probe_name = name;
  // Pairing needs no camera.
  if (pair && config.camera.uri.empty()) config.camera.uri = "none";
  if (const lightwell::Status s = config.validate(); !s.ok()) {
    lightwell::log_error(s.message());
    return kUsage;
  }
  const lightwell::Status done = pair    ? lightwell::run_pairing(config, pair_listen)
                                 : check ? lightwell::check_daemon(config)
                                         : lightwell::run_daemon(config);
  if (!done.ok()) {
    lightwell::log_error(done.message());
    return kFailed;
  }
  if (check && !pair) std::cout << "lightwelld: all is well\n";
  return kOk;
}
