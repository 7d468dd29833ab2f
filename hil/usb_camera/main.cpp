// lightwell-usb-camera: a simulated USB camera that QEMU plugs into its guest.
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "camera/uri.hpp"
#include "camera/uri_values.hpp"
#include "usb_camera/scene_source.hpp"
#include "usb_camera/server.hpp"
#include "usb_camera/scene_renderer.hpp"

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

/// "640x480:yuyv:30:1ms,8ms"; rate and exposures may be left out.
struct Ahead {
  StreamFormat format;
  std::vector<double> exposure_s;
};

Result<Ahead> parse_ahead(const std::string& text, const SupportedFormats& offer) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(':', at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  const auto bad = [&](const std::string& what) {
    return Status(StatusCode::invalid_argument, "--ahead " + text + ": " + what);
  };
  if (parts.size() < 2 || parts.size() > 4) return bad("should be WIDTHxHEIGHT:FORMAT[:RATE[:EXPOSURE,...]]");
  Ahead out;
  out.format.rate = offer.default_rate;
  const std::size_t cross = std::min(parts[0].find('x'), parts[0].size());
  const Result<int> width = uri_number(parts[0].substr(0, cross), 1, 10000);
  const Result<int> height = uri_number(cross < parts[0].size() ? parts[0].substr(cross + 1) : "", 1, 10000);
  if (!width || !height) return bad("'" + parts[0] + "' is no size, as 640x480 is");
  out.format.size = {*width, *height};
  if (std::find(offer.sizes.begin(), offer.sizes.end(), out.format.size) == offer.sizes.end())
    return bad("the camera does not offer this size");
  const auto encoding = std::find_if(offer.encodings.begin(), offer.encodings.end(),
                                     [&](Encoding e) { return to_string(e) == parts[1]; });
  if (encoding == offer.encodings.end()) return bad("'" + parts[1] + "' is none of yuyv, nv12, mjpeg");
  out.format.encoding = *encoding;
  if (parts.size() > 2) {
    const Result<int> rate = uri_number(parts[2], 1, 1000);
    if (!rate || std::find(offer.rates.begin(), offer.rates.end(), *rate) == offer.rates.end())
      return bad("the camera does not offer the rate '" + parts[2] + "'");
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
  const Result<Ahead> what = parse_ahead(of, offer_for(rig_of(scene.uri)));
  if (!what) return fail(kUsage, what.status());
  const Result<std::shared_ptr<SceneRenderer>> renderer = SceneRenderer::open(scene.uri, scene.lens, scene.jpeg_quality, what->format);
  if (!renderer) return fail(kBadInput, renderer.status());
  std::cout << calibration_to_text((*renderer)->calibration());
  return kOk;
}

std::string rendering_json(const SceneSource& source) {
  const RenderCounts c = source.counts();
  char text[200];
  std::snprintf(text, sizeof text,
                "{\"rendered\": %llu, \"kept\": %llu, \"kept_bytes\": %llu, \"render_s\": %.3f, \"failed\": %llu}",
                static_cast<unsigned long long>(c.rendered), static_cast<unsigned long long>(c.kept),
                static_cast<unsigned long long>(c.kept_bytes), c.render_s, static_cast<unsigned long long>(c.failed));
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A simulated USB camera (USB Video Class 1.1) outside of QEMU, plugged into the guest through usb-redir. What it "
      "shows is rendered by the simulated camera's own scene and sensor model."};
  app.footer(
      "Try:\n"
      "  lightwell-usb-camera --redir cam0.sock --control cam0.control --scene 'sim:city?rig=single&turn=30deg/s'\n"
      "and give QEMU:\n"
      "  -device qemu-xhci,id=xhci -chardev socket,id=cam0,path=cam0.sock,reconnect=1\n"
      "  -device usb-redir,chardev=cam0,bus=xhci.0\n"
      "In the guest it is a stock uvcvideo camera. Commands to the control socket: hil/README.md.\n"
      "It ends on SIGINT and SIGTERM.\n"
      "Exit status: 0 it was told to end, 1 it cannot go on, 2 wrong usage, 3 an input is wrong.");
  ServerOptions sockets;
  SceneOptions scene;
  DeviceOptions device_options;
  std::string log_path;
  std::vector<std::string> ahead_texts;
  std::string calibration_of;
  std::size_t memory_mib = 1024;
  app.add_option("--redir", sockets.redir_path, "Unix socket at which QEMU's chardev finds the camera");
  app.add_option("--control", sockets.control_path, "Unix socket for commands; without it there are none");
  app.add_option("--scene", scene.uri, "What it shows: a URI of the simulated camera, without sensor=")
      ->capture_default_str();
  app.add_option("--lens", scene.lens, "Of the scene's rig; a pair of lenses is two cameras")->capture_default_str();
  const std::map<std::string, Pace> paces = {{"rate", Pace::rate}, {"guest", Pace::guest}, {"free", Pace::free}};
  app.add_option(
         "--pace", device_options.stream.pace,
         "rate: its own, drops what the guest does not take (default); guest: waits for the guest; free: as fast "
         "as the guest takes frames")
      ->transform(CLI::CheckedTransformer(paces, CLI::ignore_case).description("{rate,guest,free}"));
  app.add_option("--ahead", ahead_texts,
                 "Renders before it is plugged in: WIDTHxHEIGHT:FORMAT[:RATE[:EXPOSURE,...]], again for more")
      ->allow_extra_args(false);
  app.add_option("--control-latency", device_options.stream.control_latency,
                 "A control that is set while frame n is exposed acts from frame n + this")
      ->check(CLI::Range(0, 30))
      ->capture_default_str();
  app.add_option("--payload", device_options.payload_bytes, "Bytes of a UVC payload with its header; 0: a whole frame")
      ->check(CLI::IsMember({0}) | CLI::Range(64, 1 << 30))
      ->capture_default_str();
  app.add_option("--jpeg-quality", scene.jpeg_quality, "Of motion JPEG")
      ->check(CLI::Range(1, 95))
      ->capture_default_str();
  app.add_flag("--stamp", device_options.stream.stamp, "Writes each frame's number into its first 16 pixels");
  app.add_option("--serial", device_options.identity.serial, "The device's serial number")->capture_default_str();
  app.add_option("--threads", scene.threads, "That render")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--memory", memory_mib, "MiB of rendered pictures that are kept")
      ->check(CLI::Range(16, 65536))
      ->capture_default_str();
  app.add_option("--log", log_path, "File that gets a line of JSON for every frame");
  app.add_option("--calibration", calibration_of,
                 "Prints what the pixels of WIDTHxHEIGHT:FORMAT mean, for lightwelld --calibration, and ends");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  scene.memory = memory_mib << 20;
  if (!calibration_of.empty()) return print_calibration(calibration_of, scene);
  if (sockets.redir_path.empty()) {
    std::cerr << "lightwell-usb-camera: where is it plugged in? Give --redir; see --help\n";
    return kUsage;
  }

  // Signals have a server from the moment that there is one.
  std::unique_ptr<Server> server;
  Result<std::unique_ptr<SceneSource>> source = SceneSource::open(scene, [&] {
    if (running != nullptr) running->wake();
  });
  if (!source) return fail(kBadInput, source.status());
  device_options.offer = offer_for(rig_of(scene.uri));
  for (const std::string& text : ahead_texts) {
    const Result<Ahead> ahead = parse_ahead(text, device_options.offer);
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
  targets.rendering = [&] { return rendering_json(**source); };
  Result<std::unique_ptr<Server>> opened = Server::open(sockets, targets);
  if (!opened) return fail(kBadInput, opened.status());
  server = std::move(*opened);
  running = server.get();
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  std::printf("lightwell-usb-camera: plugged in at %s\n", sockets.redir_path.c_str());
  std::fflush(stdout);
  const Status ended = server->run();
  // Rendering threads wake the server: they end first.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  source->reset();
  running = nullptr;
  return ended.ok() ? kOk : fail(kFailed, ended);
}
