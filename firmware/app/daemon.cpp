#include "app/daemon.hpp"

#include <csignal>
#include <ctime>
#include <iostream>
#include <optional>

#include <lightwell/descriptor.hpp>
#include <lightwell/mounting.hpp>
#include <lightwell/text.hpp>

#include "app/backend_table.hpp"
#include "app/estimator_table.hpp"
#include "app/log.hpp"
#include "app/network.hpp"
#include "app/pipeline.hpp"
#include "app/service_manager.hpp"
#include "camera/frame_recorder.hpp"
#include "link/access/bind_policy.hpp"

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

/// Checks that calibration and camera agree in the number and size of lenses; otherwise every frame would be refused.
Status check_calibration_size(const RigParameters& rig, const CameraInfo& camera) {
  const auto size = [](std::size_t lenses, int width, int height) {
    return std::to_string(lenses) + " x " + std::to_string(width) + "x" + std::to_string(height);
  };
  for (const LensParameters& lens : rig.lenses)
    if (rig.lenses.size() != static_cast<std::size_t>(camera.lenses) || lens.width != camera.width ||
        lens.height != camera.height)
      return {StatusCode::invalid_argument,
              "the calibration is for " + size(rig.lenses.size(), lens.width, lens.height) + " pixels, camera " +
                  camera.name + " delivers " +
                  size(static_cast<std::size_t>(camera.lenses), camera.width, camera.height) +
                  ": calibrate at this size, or set camera.width and camera.height to the calibration's"};
  return {};
}

Result<DaemonComponents> make_components(const Config& config) {
  DaemonComponents components;
  Result<std::unique_ptr<CameraBackend>> camera = make_backend(config.camera);
  if (!camera) return camera.status();
  components.camera = std::move(*camera);
  Result<CameraInfo> info = components.camera->open();
  if (!info) return info.status();
  components.info = std::move(*info);
  log_info("camera " + components.info.name + ": " + std::to_string(components.info.lenses) + " x " +
           std::to_string(components.info.width) + "x" + std::to_string(components.info.height) + " " +
           std::string(to_string(components.info.format)));
  for (const std::string& note : components.info.notes) log_info("camera: " + note);
  if (!config.calibration.empty()) {
    Result<RigParameters> rig = load_calibration(config.calibration);
    if (!rig) return rig.status();
    components.rig = std::move(*rig);
  } else if (components.info.calibration) {
    components.rig = *components.info.calibration;
  } else {
    return Status(StatusCode::failed_precondition,
                  "the camera has no calibration of its own: name one with `calibration` in the configuration or "
                  "--calibration");
  }
  if (Status s = check_calibration_size(components.rig, components.info); !s.ok()) return s;
  if (!config.mounting.empty()) {
    const Result<UncertainPose> mounting = load_mounting(config.mounting);
    if (!mounting) return mounting.status();
    components.mounting = *mounting;
  }
  Result<std::unique_ptr<Estimator>> estimator = make_estimator(config, components.rig, components.mounting);
  if (!estimator) return estimator.status();
  components.estimator = std::move(*estimator);
  return components;
}

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

std::string over_budget_message(double ms, double budget_ms) {
  return formatted(
      "budget: an estimate takes %.3g ms even at the setting fast, and the budget is %.3g ms; set a larger one with "
      "--budget-ms, or smaller pictures with --size",
      ms, budget_ms);
}

}  // namespace

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
  if (const Status s = check_bind_policy(config.grpc); !s.ok()) return s;
  return make_components(config).status();
}

Status run_daemon(const Config& config) {
  Result<DaemonComponents> components = make_components(config);
  if (!components) return components.status();

  ProbeIdentity identity{config.probe_name,
                         fnv1a_32(config.probe_name),
                         calibration_identity(components->rig),
                         std::string(kFirmwareVersion),
                         components->info.name,
                         components->mounting};
  Pipeline pipeline(identity, std::move(components->estimator), config.estimator, config.budget_ms);
  if (Status s = add_links(config, pipeline, pipeline.publisher()); !s.ok()) return s;

  std::unique_ptr<FrameRecorder> recorder;
  if (!config.record_path.empty()) {
    const RecordingHeader header{RecordingKind::frames, config.probe_name, identity.version,
                                 encode_calibration(components->rig)};
    Result<std::unique_ptr<FrameRecorder>> made = FrameRecorder::open(config.record_path, header, pipeline.sink());
    if (!made) return made.status();
    recorder = std::move(*made);
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
  notify_ready("looking");
  NetworkMonitor network(config, pipeline.status(), pipeline.publisher());

  std::string logged_error;
  std::uint64_t logged_faults = 0;
  bool logged_end = false, logged_over_budget = false, logged_lost = false;
  Setting logged_setting = config.estimator.setting;
  while (!wait_for_stop_signal()) {
    const StatusSnapshot status = pipeline.status();
    notify_status(status_line(status));
    network.poll();
    if (const std::string e = pipeline.last_error(); e != logged_error) {
      log_error(e);
      logged_error = e;
    }
    if (recorder && recorder->faults() != logged_faults) {
      logged_faults = recorder->faults();
      log_error("recording: " + recorder->last_error().message() + "; the probe goes on without it");
    }
    if (const Setting now = pipeline.setting(); now != logged_setting) {
      log_info("budget: setting " + std::string(to_string(logged_setting)) + " -> " + std::string(to_string(now)));
      logged_setting = now;
    }
    if (const std::optional<double> ms = pipeline.over_budget_ms(); ms && !logged_over_budget) {
      log_error(over_budget_message(*ms, config.budget_ms));
      logged_over_budget = true;
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
  notify_stopping();
  components->camera->stop();
  if (recorder)
    if (const Status s = recorder->finish(); !s.ok()) log_error("recording: " + s.message());
  pipeline.stop();
  log_info(status_line(pipeline.status()));
  return {};
}

}  // namespace lightwell
