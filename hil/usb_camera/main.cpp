// lightwell-usb-camera: a simulated USB camera that QEMU attaches to its guest.
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "imaging/uri.hpp"
#include "usb_camera/scene_source.hpp"
#include "usb_camera/server.hpp"

namespace {

using namespace lightwell;
using namespace lightwell::usb_camera;

enum Exit : int { kOk = 0, kFailed = 1, kUsage = 2, kBadInput = 3 };

Server* running = nullptr;

extern "C" void on_signal(int) { running->stop(); }

int fail(Exit code, const Status& status) {
  std::cerr << "lightwell-usb-camera: " << status.message() << "\n";
  return code;
}

/// Value of --ahead: "640x480:yuyv:30:1ms,8ms"; rate and exposures are optional.
struct Ahead {
  StreamFormat format;
  std::vector<double> exposure_s;
};

Result<Ahead> parse_ahead(const std::string& text, const SupportedFormats& formats) {
  const std::vector<std::string_view> views = separated(text, ':');
  const std::vector<std::string> parts(views.begin(), views.end());
  const auto bad = [&](const std::string& what) {
    return Status(StatusCode::invalid_argument, "--ahead " + text + ": " + what);
  };
  if (parts.size() < 2 || parts.size() > 4) return bad("must be WIDTHxHEIGHT:FORMAT[:RATE[:EXPOSURE,...]]");
  Ahead out;
  out.format.rate = formats.default_rate;
  const std::size_t cross = std::min(parts[0].find('x'), parts[0].size());
  const Result<int> width = uri_number(parts[0].substr(0, cross), 1, 10000);
  const Result<int> height = uri_number(cross < parts[0].size() ? parts[0].substr(cross + 1) : "", 1, 10000);
  if (!width || !height) return bad("'" + parts[0] + "' is not a size such as 640x480");
  out.format.size = {*width, *height};
  if (std::find(formats.sizes.begin(), formats.sizes.end(), out.format.size) == formats.sizes.end())
    return bad("the camera does not support this size");
  const auto encoding = std::find_if(formats.encodings.begin(), formats.encodings.end(),
                                     [&](Encoding e) { return to_string(e) == parts[1]; });
  if (encoding == formats.encodings.end()) return bad("'" + parts[1] + "' is none of yuyv, nv12, mjpeg");
  out.format.encoding = *encoding;
  if (parts.size() > 2) {
    const Result<int> rate = uri_number(parts[2], 1, 1000);
    if (!rate || std::find(formats.rates.begin(), formats.rates.end(), *rate) == formats.rates.end())
      return bad("the camera does not support the rate '" + parts[2] + "'");
    out.format.rate = *rate;
  }
  if (parts.size() > 3) {
    Result<std::vector<double>> exposures = uri_durations_s(parts[3]);
    if (!exposures) return bad(exposures.status().message());
    out.exposure_s = std::move(*exposures);
  }
  return out;
}

std::string rig_of(const std::string& scene) {
  const Result<CameraUri> uri = parse_camera_uri(scene);
  std::string rig;
  if (uri)
    for (const auto& [name, value] : uri->parameters)
      if (name == "rig") rig = value;
  return rig;
}

int print_calibration(const std::string& of, const SceneOptions& scene) {
  const Result<Ahead> what = parse_ahead(of, formats_for(rig_of(scene.uri)));
  if (!what) return fail(kUsage, what.status());
  const Result<std::shared_ptr<SceneRenderer>> renderer =
      SceneRenderer::open(scene.uri, scene.lens, scene.jpeg_quality, what->format);
  if (!renderer) return fail(kBadInput, renderer.status());
  std::cout << calibration_to_text((*renderer)->calibration());
  return kOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A simulated USB camera (USB Video Class 1.1) outside of QEMU, attached to the guest by usb-redir. Its images "
      "are "
      "rendered with the scene and sensor model of the firmware's simulated camera."};
  app.footer(
      "Example:\n"
      "  lightwell-usb-camera --redir cam0.sock --control cam0.control --scene 'sim:city?rig=single&yaw_rate=30deg/s'\n"
      "and give QEMU:\n"
      "  -device qemu-xhci,id=xhci -chardev socket,id=cam0,path=cam0.sock,reconnect=1\n"
      "  -device usb-redir,chardev=cam0,bus=xhci.0\n"
      "The guest uses its uvcvideo driver. Commands of the control socket: hil/README.md.\n"
      "The program ends on SIGINT and SIGTERM.\n"
      "Exit status: 0 ended by a signal, 1 run-time error, 2 wrong usage, 3 invalid input.");
  ServerOptions sockets;
  SceneOptions scene;
  DeviceOptions device_options;
  std::string log_path;
  std::vector<std::string> ahead_texts;
  std::string calibration_of;
  std::size_t memory_mib = 1024;
  app.add_option("--redir", sockets.redir_path, "Unix socket to which QEMU's chardev connects");
  app.add_option("--control", sockets.control_path, "Unix socket for commands [none]");
  app.add_option("--scene", scene.uri, "The scene: a URI of the simulated camera, without sensor= and gain=")
      ->capture_default_str();
  app.add_option("--lens", scene.lens, "Index of the lens in the scene's rig; each lens is a camera")
      ->capture_default_str();
  const std::map<std::string, Pace> paces = {{"rate", Pace::rate}, {"guest", Pace::guest}, {"free", Pace::free}};
  app.add_option(
         "--pace", device_options.stream.pace,
         "rate: at the negotiated rate, dropping frames that the guest does not fetch (default); guest: waits for the "
         "guest; free: as fast as the guest fetches frames")
      ->transform(CLI::CheckedTransformer(paces, CLI::ignore_case).description("{rate,guest,free}"));
  app.add_option("--ahead", ahead_texts,
                 "Renders these frames before the start: WIDTHxHEIGHT:FORMAT[:RATE[:EXPOSURE,...]]; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--control-latency", device_options.stream.control_latency,
                 "A control that is set while frame n is exposed acts from frame n + this number")
      ->check(CLI::Range(0, 30))
      ->capture_default_str();
  app.add_option("--payload", device_options.payload_bytes,
                 "Bytes of a UVC payload including its header; 0: a whole frame")
      ->check(CLI::IsMember({0}) | CLI::Range(64, 1 << 30))
      ->capture_default_str();
  app.add_option("--jpeg-quality", scene.jpeg_quality, "Quality of motion JPEG")
      ->check(CLI::Range(1, 95))
      ->capture_default_str();
  app.add_flag("--stamp", device_options.stream.stamp, "Writes each frame's number into its first 16 pixels");
  app.add_option("--serial", device_options.identity.serial, "The device's serial number")->capture_default_str();
  app.add_option("--threads", scene.threads, "Number of rendering threads")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--memory", memory_mib, "MiB of cached images")->check(CLI::Range(16, 65536))->capture_default_str();
  app.add_option("--log", log_path, "Writes a line of JSON for every frame to this file");
  app.add_option("--calibration", calibration_of,
                 "Prints the calibration for WIDTHxHEIGHT:FORMAT, for lightwelld --calibration, and ends");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  scene.memory = memory_mib << 20;
  if (!calibration_of.empty()) return print_calibration(calibration_of, scene);
  if (sockets.redir_path.empty()) {
    std::cerr << "lightwell-usb-camera: --redir is missing; see --help\n";
    return kUsage;
  }

  // Declared before the frame source, whose threads wake the server.
  std::unique_ptr<Server> server;
  Result<std::unique_ptr<SceneSource>> source = SceneSource::open(scene, [&] {
    if (running != nullptr) running->wake();
  });
  if (!source) return fail(kBadInput, source.status());
  for (const std::string& note : (*source)->notes()) std::cerr << "lightwell-usb-camera: " << note << "\n";
  device_options.formats = formats_for(rig_of(scene.uri));
  for (const std::string& text : ahead_texts) {
    const Result<Ahead> ahead = parse_ahead(text, device_options.formats);
    if (!ahead) return fail(kUsage, ahead.status());
    if (Status done = (*source)->render_ahead(ahead->format, ahead->exposure_s); !done.ok()) return fail(kFailed, done);
  }
  FrameLog log;
  if (!log_path.empty()) {
    if (Status opened = log.write_to(log_path); !opened.ok()) return fail(kBadInput, opened);
  }
  Device device(device_options, **source, log);
  CommandTargets targets;
  targets.device = &device;
  targets.log = &log;
  targets.set_scene = [&](const std::string& text) { return (*source)->set_scene(text); };
  targets.render_counts = [&] { return (*source)->counts(); };
  Result<std::unique_ptr<Server>> opened = Server::open(sockets, targets);
  if (!opened) return fail(kBadInput, opened.status());
  server = std::move(*opened);
  running = server.get();
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  std::printf("lightwell-usb-camera: plugged in at %s\n", sockets.redir_path.c_str());
  std::fflush(stdout);
  const Status ended = server->run();
  // The rendering threads wake the server, so they end first.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  source->reset();
  running = nullptr;
  return ended.ok() ? kOk : fail(kFailed, ended);
}
