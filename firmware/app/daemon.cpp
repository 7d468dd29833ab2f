#include "app/daemon.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>

#include <systemd/sd-daemon.h>

#include <lightwell/advertisement.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/pairing.hpp>
#include <lightwell/text.hpp>
#include <lightwell/time.hpp>

#include "app/component_tables.hpp"
#include "app/pipeline.hpp"
#include "app/temperature.hpp"
#include "camera/frame_recorder.hpp"
#include "link/access/probe_keys.hpp"
#include "link/grpc/grpc_link.hpp"
#include "link/grpc/pairing_window.hpp"
#include "link/recordings/probe_recorder.hpp"
#include "link/usb_gadget/usb_gadget_link.hpp"
#ifdef LIGHTWELL_HAVE_LINK_MQTT
#include "link/mqtt/mqtt_link.hpp"
#endif
#ifdef LIGHTWELL_HAVE_LINK_WEB
#include "link/web/web_link.hpp"
#endif
#ifdef LIGHTWELL_HAVE_DISCOVERY
#include "link/discovery/advertiser.hpp"
#endif

namespace lightwell {
namespace {

/// The parts that are created before anything runs.
struct DaemonComponents {
  std::unique_ptr<CameraBackend> camera;
  CameraInfo info;
  RigParameters rig;
  std::unique_ptr<Estimator> estimator;
  std::optional<UncertainPose> mounting;
};

std::string size_text(int lenses, int width, int height) {
  return std::to_string(lenses) + " x " + std::to_string(width) + "x" + std::to_string(height);
}

/// Checks that calibration and camera agree in the number and size of lenses; otherwise every frame would be refused.
Status check_calibration_size(const RigParameters& rig, const CameraInfo& camera) {
  const std::string delivered = size_text(camera.lenses, camera.width, camera.height);
  for (const LensParameters& lens : rig.lenses)
    if (const std::string size = size_text(static_cast<int>(rig.lenses.size()), lens.width, lens.height);
        size != delivered)
      return invalid_argument("the calibration is for " + size + " pixels, camera " + camera.name + " delivers " +
                              delivered +
                              ": calibrate at this size, or set camera.width and camera.height to the calibration's");
  return {};
}

Result<DaemonComponents> make_components(const Config& config) {
  DaemonComponents components;
  CameraInfo& info = components.info;
  if (Status s = make_backend(config.camera).assign_to(components.camera); !s.ok()) return s;
  if (Status s = components.camera->open().assign_to(info); !s.ok()) return s;
  log_info("camera " + info.name + ": " + size_text(info.lenses, info.width, info.height) + " " +
           std::string(to_string(info.format)));
  for (const std::string& note : info.notes) log_info("camera: " + note);
  if (!config.calibration.empty()) {
    if (Status s = load_calibration(config.calibration).assign_to(components.rig); !s.ok()) return s;
  } else if (info.calibration) {
    components.rig = *info.calibration;
  } else {
    return Status(StatusCode::failed_precondition,
                  "the camera has no calibration of its own: name one with `calibration` in the configuration or "
                  "--calibration");
  }
  if (Status s = check_calibration_size(components.rig, info); !s.ok()) return s;
  if (!config.mounting.empty())
    if (Status s = load_mounting(config.mounting).assign_to(components.mounting); !s.ok()) return s;
  if (Status s = make_estimator(config, components.rig, components.mounting).assign_to(components.estimator); !s.ok())
    return s;
  return components;
}

/// Adds the links of `config` to `publisher`. failed_precondition: a link or the announcement is configured, but not in
/// this build.
Status add_links(const Config& config, Commands& commands, Publisher& publisher) {
  publisher.add(make_grpc_link(config.grpc, config.probe_name, commands));
  if (config.usb_gadget) publisher.add(make_usb_gadget_link(*config.usb_gadget, commands));
  if (config.mqtt) {
#ifdef LIGHTWELL_HAVE_LINK_MQTT
    publisher.add(make_mqtt_link(*config.mqtt, config.probe_name, commands));
#else
    return {StatusCode::failed_precondition,
            "mqtt: this lightwelld was built without MQTT; install libmosquitto-dev and build it again, or leave "
            "`mqtt` out"};
#endif
  }
  if (config.web) {
#ifdef LIGHTWELL_HAVE_LINK_WEB
    publisher.add(make_web_link(*config.web, config.web_keys(), config.probe_name, commands, dashboard_files()));
#else
    return {StatusCode::failed_precondition,
            "web: this lightwelld was built without libwebsockets; install libwebsockets-dev and build it again, or "
            "leave `web` out"};
#endif
  }
#ifndef LIGHTWELL_HAVE_DISCOVERY
  if (config.mdns == Mdns::on)
    return {
        StatusCode::failed_precondition,
        "discovery: this lightwelld was built without Avahi; install libavahi-client-dev and build it again, or leave "
        "`discovery` out"};
#endif
  return {};
}

/// Announces the probe if that is configured, and logs when a link or the announcement fails or recovers.
class NetworkMonitor {
 public:
  /// Call it after the links have been started.
  NetworkMonitor([[maybe_unused]] const Config& config, [[maybe_unused]] const StatusSnapshot& status,
                 const Publisher& publisher)
      : publisher_(publisher) {
#ifdef LIGHTWELL_HAVE_DISCOVERY
    if (config.mdns != Mdns::on) return;
    Advertisement a{status.probe_name, status.probe_id, status.calibration_id, status.version, kWireVersion, {}};
    for (const auto& link : publisher.links())
      if (AdvertisedLink shown = advertised_link(link->address()); !shown.uri.empty())
        a.links.push_back(std::move(shown));
    advertiser_ = make_advertiser(a);
    // Any text but "", so that the announced name is logged.
    last_logged_["discovery"] = "nothing logged yet";
#endif
  }

  /// Logs changes; call it about once a second.
  void poll() {
    for (const auto& link : publisher_.links()) log_transition(link->address(), link->error_message(), "connected");
#ifdef LIGHTWELL_HAVE_DISCOVERY
    if (advertiser_)
      log_transition("discovery", advertiser_->error_message(), "announced as '" + advertiser_->announced_as() + "'");
#endif
    // At most once a minute, so that a flood of invalid messages does not fill the log.
    constexpr std::int64_t kMinute = 60'000'000'000;
    const std::uint64_t refused = publisher_.counters().messages_refused;
    const std::int64_t now = monotonic_now_ns();
    if (refused == logged_refused_ || (logged_refused_ns_ != 0 && now - logged_refused_ns_ < kMinute)) return;
    log_error(std::to_string(refused) +
              " messages from outside have been refused: malformed, not for this probe, or too many");
    logged_refused_ = refused;
    logged_refused_ns_ = now;
  }

 private:
  void log_transition(const std::string& what, const std::string& error_message, const std::string& good) {
    std::string& last_logged = last_logged_[what];
    if (last_logged == error_message) return;
    last_logged = error_message;
    error_message.empty() ? log_info(what + ": " + good)
                          : log_error(what + ": " + error_message + "; it is tried again");
  }

  const Publisher& publisher_;
#ifdef LIGHTWELL_HAVE_DISCOVERY
  std::unique_ptr<Advertiser> advertiser_;
#endif
  std::map<std::string, std::string> last_logged_;
  std::uint64_t logged_refused_ = 0;
  std::int64_t logged_refused_ns_ = 0;
};

/// The recorder of the folder in `config`; null without a folder. A folder that cannot be used now is logged: it may be
/// on a disk that comes later.
std::unique_ptr<ProbeRecorder> make_probe_recorder(const Config& config) {
  if (!config.recordings) return nullptr;
  // Planes hold a photograph, which is stored only if the owner lets clients have it.
  const bool planes = config.plane && config.texture_recipients() == ImageRecipients::all_clients;
  const RecordingKind kind = planes ? RecordingKind::descriptors_and_planes : RecordingKind::descriptors;
  auto recorder = std::make_unique<ProbeRecorder>(
      *config.recordings, RecordingHeader{kind, config.probe_name, std::string(kFirmwareVersion), {}});
  if (const Status s = recorder->check_folder(); !s.ok())
    log_error("recordings in " + config.recordings->folder + ": " + s.message());
  return recorder;
}

/// Logs when a recording of clients starts, ends or fails.
class RecordingMonitor {
 public:
  explicit RecordingMonitor(std::string folder) : folder_(std::move(folder)) {}

  /// Call it about once a second.
  void poll(const std::optional<RecordingStatus>& now) {
    if (!now) return;
    const std::string file = folder_ + "/" + now->file;
    if (now->running && (now->file != logged_.file || !logged_.running)) log_info("recording to " + file);
    if (now->faults != logged_.faults)
      log_error("recording to " + file + " has ended: " + now->end_reason);
    else if (!now->running && logged_.running)
      log_info("recorded " + std::to_string(now->descriptors) + " descriptors in " + file);
    logged_ = *now;
  }

 private:
  const std::string folder_;
  RecordingStatus logged_;
};

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

/// Waits for a stop signal for up to one second; true if one came.
bool wait_for_stop_signal() {
  const sigset_t set = stop_signals();
  const timespec second{1, 0};
  return sigtimedwait(&set, nullptr, &second) > 0;
}

std::string status_line(const StatusSnapshot& s) {
  return std::to_string(s.counters.estimates) + " estimates, " + std::to_string(s.counters.captures_dropped) +
         " captures dropped, " + std::to_string(s.counters.estimates_failed) + " failed, " +
         std::to_string(s.counters.clients) + " clients";
}

/// Notifies systemd (sd_notify) of `state`, with a line for `systemctl status`. Without systemd it does nothing.
void notify_systemd(const std::string& state, const std::string& status) {
  sd_notify(0, (state + "\nSTATUS=" + printable(status)).c_str());
}

std::string over_budget_message(double ms, double budget_ms) {
  return formatted(
      "budget: an estimate takes %.3g ms even at the setting fastest, and the budget is %.3g ms; set a larger one with "
      "--budget-ms, or smaller pictures with --size",
      ms, budget_ms);
}

std::string over_bound_message(double bound, double max_bound) {
  return formatted(
      "max_bound: descriptors state a bound of %.3g even at the configured setting, and %.3g is asked; "
      "set a larger one with --max-bound, or a richer estimator.setting",
      bound, max_bound);
}

Status status_of(PairingOutcome outcome, const PairingWindow& window) {
  if (outcome == PairingOutcome::paired) return {};
  if (outcome == PairingOutcome::too_many_wrong_codes)
    return {StatusCode::unavailable,
            "three wrong codes were received and the window is closed: if you entered none of them, somebody on the "
            "network is guessing"};
  return {StatusCode::unavailable, "no client was paired (" + std::to_string(window.wrong_codes()) +
                                       " wrong codes); start again for a new code"};
}

/// Writes one line to stderr, with journald's priority prefix if stderr is the journal. Escapes control characters,
/// which texts from clients and brokers may contain.
void write_log(const char* journal_prefix, const char* plain_prefix, const std::string& line) {
  // systemd sets JOURNAL_STREAM for a service whose stderr is the journal.
  static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  std::cerr << (journal ? journal_prefix : plain_prefix) << printable(line) << std::endl;
}

}  // namespace

void log_info(const std::string& line) { write_log("<6>", "lightwelld: ", line); }
void log_error(const std::string& line) { write_log("<3>", "lightwelld: error: ", line); }

void block_stop_signals() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  // A client that closes its socket must not end the probe.
  std::signal(SIGPIPE, SIG_IGN);
  // A file size limit must be reported by write(), not end the process by a signal.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool stop_signal_pending() {
  sigset_t waiting;
  sigpending(&waiting);
  return sigismember(&waiting, SIGINT) == 1 || sigismember(&waiting, SIGTERM) == 1;
}

Status check_daemon(const Config& config) {
  if (const Status s = config.grpc.check_bind_policy(); !s.ok()) return s;
  if (config.web)
    if (const Status s = config.web->check_bind_policy(); !s.ok()) return s;
  if (config.recordings)
    if (const Status s = ProbeRecorder(*config.recordings, {}).check_folder(); !s.ok())
      return s.in("recordings in " + config.recordings->folder);
  return make_components(config).status();
}

Status run_daemon(const Config& config) {
  Result<DaemonComponents> components = make_components(config);
  if (!components) return components.status();

  const StatusSnapshot identity{config.probe_name,
                                fnv1a_32(config.probe_name),
                                calibration_identity(components->rig),
                                std::string(kFirmwareVersion),
                                components->info.name,
                                {},
                                components->mounting};
  PlaneEncoderOptions planes;
  planes.images = config.texture_recipients();
  const std::unique_ptr<ProbeRecorder> probe_recorder = make_probe_recorder(config);
  const std::unique_ptr<Preview> preview =
      config.images == ImageRecipients::all_clients ? std::make_unique<Preview>(components->rig) : nullptr;
  Pipeline pipeline(identity, std::move(components->estimator), config.estimator, {config.budget_ms, config.max_bound},
                    planes);
  pipeline.set_recordings(probe_recorder.get());
  pipeline.set_preview(preview.get());
  pipeline.set_calibration(summary_of(components->rig, std::filesystem::path(config.calibration).filename().string()));
  if (Status s = add_links(config, pipeline, pipeline.publisher()); !s.ok()) return s;

  std::unique_ptr<FrameRecorder> recorder;
  if (!config.record_path.empty()) {
    const RecordingHeader header{RecordingKind::frames, config.probe_name, identity.version,
                                 encode_calibration(components->rig)};
    if (Status s = FrameRecorder::open(config.record_path, header, pipeline.sink()).assign_to(recorder); !s.ok())
      return s;
    pipeline.watch_recorder(recorder.get());
  }
  if (Status s = pipeline.start(); !s.ok()) return s;
  FrameSink& sink = recorder ? static_cast<FrameSink&>(*recorder) : pipeline.sink();
  if (Status s = components->camera->start(sink); !s.ok()) {
    // The links use the recorder's counters, and the recorder is destroyed first.
    pipeline.stop();
    return s;
  }

  for (const auto& link : pipeline.publisher().links())
    std::cout << "lightwelld: listening on " << link->address() << std::endl;
  notify_systemd("READY=1", "looking");
  NetworkMonitor network(config, pipeline.status(), pipeline.publisher());
  RecordingMonitor recordings(config.recordings ? config.recordings->folder : "");

  std::string logged_error;
  std::uint64_t logged_faults = 0;
  bool logged_end = false, logged_over_budget = false, logged_over_bound = false, logged_lost = false;
  Setting logged_setting = config.estimator.setting;
  while (!wait_for_stop_signal()) {
    pipeline.set_temperature(read_temperature());
    const StatusSnapshot status = pipeline.status();
    notify_systemd("WATCHDOG=1", status_line(status));
    network.poll();
    recordings.poll(status.recording);
    const Pipeline::Health health = pipeline.health();
    if (health.last_error != logged_error) {
      log_error(health.last_error);
      logged_error = health.last_error;
    }
    if (recorder && recorder->faults() != logged_faults) {
      logged_faults = recorder->faults();
      log_error("recording: " + recorder->last_error().message() + "; the probe goes on without it");
    }
    if (health.setting != logged_setting) {
      log_info("governor: setting " + std::string(to_string(logged_setting)) + " -> " +
               std::string(to_string(health.setting)));
      logged_setting = health.setting;
    }
    if (health.over_budget_ms && !logged_over_budget) {
      log_error(over_budget_message(*health.over_budget_ms, config.budget_ms));
      logged_over_budget = true;
    }
    if (health.over_bound && !logged_over_bound) {
      log_error(over_bound_message(*health.over_bound, config.max_bound));
      logged_over_bound = true;
    }
    const CameraBackend::State state = components->camera->state();
    if (const bool lost = state == CameraBackend::State::lost; lost != logged_lost) {
      logged_lost = lost;
      lost ? log_error("the camera was disconnected") : log_info("the camera is connected again");
    }
    if (state == CameraBackend::State::finished) {
      // Wait for one more second, in which the last capture is estimated and sent to the clients.
      if (logged_end) break;
      logged_end = true;
      log_info("the recording has come to its end");
    }
  }
  sd_notify(0, "STOPPING=1");
  components->camera->stop();
  if (recorder)
    if (const Status s = recorder->finish(); !s.ok()) log_error("recording: " + s.message());
  pipeline.stop();
  log_info(status_line(pipeline.status()));
  return {};
}

Status run_pairing(const Config& config, const std::string& listen) {
  const bool web_alone = !config.grpc.encrypted() && config.web && config.web->encrypted();
  if (!config.grpc.encrypted() && !web_alone)
    return {StatusCode::failed_precondition,
            "pairing needs encryption: set grpc.security or web.security to LINK_SECURITY_TLS or "
            "LINK_SECURITY_MUTUAL_TLS, or use --security tls or --web-security tls"};
  const std::string& link_address = web_alone ? config.web->listen_address : config.grpc.listen_address;
  const Result<ProbeKeys> keys =
      load_probe_keys(web_alone ? config.web_keys() : config.grpc, config.probe_name, std::time(nullptr));
  if (!keys) return keys.status();
  PairingWindowOptions options;
  options.listen = listen.empty()
                       ? link_address.substr(0, link_address.rfind(':')) + ":" + std::to_string(kDefaultPairingPort)
                       : listen;
  options.probe_name = config.probe_name;
  // That of the gRPC link, if paired clients can use it.
  if (!web_alone) options.port = parse_number<int>(link_address.substr(link_address.rfind(':') + 1)).value_or(0);
  options.client_certificate_days = config.grpc.client_certificate_days;
  const Result<std::unique_ptr<PairingWindow>> opened = PairingWindow::open(options, *keys);
  if (!opened) return opened.status();
  PairingWindow& window = **opened;
  std::cout << "lightwelld: pairing on " << window.address() << " for " << options.open_for.count() << " s, code "
            << window.code() << std::endl;
  PairingOutcome outcome = PairingOutcome::open;
  while (outcome == PairingOutcome::open && !stop_signal_pending())
    outcome = window.wait(std::chrono::milliseconds(100));
  if (outcome == PairingOutcome::paired) log_info("paired with " + window.client_name());
  return status_of(outcome, window);
}

}  // namespace lightwell
