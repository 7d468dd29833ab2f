// A fake of the daemon's Commands interface that records calls, for tests of links.
#pragma once

#include <mutex>
#include <optional>

#include <lightwell/commands.hpp>

namespace lightwell::test {

/// Returns a fixed status and stores the arguments of commands.
class FakeCommands : public Commands {
 public:
  StatusSnapshot status() const override {
    StatusSnapshot s;
    s.probe_name = "attic";
    s.probe_id = 11;
    s.calibration_id = 12;
    s.version = "0.1.0";
    s.camera = "fake camera";
    // All values differ, so that swapped counters are detected.
    s.counters = {.frames = 5,
                  .captures_dropped = 102,
                  .brackets_incomplete = 103,
                  .estimates = 104,
                  .estimates_failed = 105,
                  .descriptors_coalesced = 106,
                  .clients = 107,
                  .frames_recorded = 108,
                  .recording_faults = 3,
                  .frames_lost = 110,
                  .setting_moves = 111,
                  .estimates_late = 112,
                  .estimates_late_at_fast = 113,
                  .messages_refused = 114,
                  .authentication_failures = 115,
                  .client_list_faults = 116};
    s.temperature_c = 47.5F;
    s.links = {{"grpc", 121, 122, 123, 124, false}, {"mqtt", 125, 126, 127, 128, true}};
    s.recording = RecordingStatus{true, "20260101T120000Z-0001.lwr", 117, 118, 119, "full", 120};
    s.T_world_probe = UncertainPose{{{0.6, 0, 0, 0.8}, {1, 2, 3}}, {}};
    s.T_world_probe->covariance[0][0] = 1e-4;
    s.T_world_probe->covariance[0][5] = s.T_world_probe->covariance[5][0] = 1e-5;
    s.T_world_probe->covariance[5][5] = 1e-6;
    return s;
  }
  EstimatorConfig estimator() const override {
    const std::lock_guard lock(mutex_);
    return config_;
  }
  EstimatorKind estimator_kind() const override { return kind_; }
  Status update_estimator(const EstimatorUpdate& update) override {
    const std::lock_guard lock(mutex_);
    const EstimatorConfig config = updated(config_, update);
    if (Status s = config.validate(kind_); !s.ok()) return s;
    config_ = config;
    return {};
  }
  Result<double> report_lux(double lux, Vec3d normal) override {
    const std::lock_guard lock(mutex_);
    lux_ = lux;
    normal_ = normal;
    return 2 * lux;
  }
  CalibrationSummary calibration() const override {
    const CalibrationReport report{1'700'000'000, 0.125, 4321, {88.5, 87.5}, {0.02, 0.03}, 1'700'000'001};
    return {12,
            "rig.textproto",
            true,
            {{640, 480, "kannala_brandt", 95, "table", true, true}, {320, 240, "mei", 90, "srgb", false, false}},
            report};
  }
  /// The recording of status(), running or not.
  Result<RecordingStatus> control_recording(RecordingAction action) override {
    const std::lock_guard lock(mutex_);
    action_ = action;
    RecordingStatus recording = *FakeCommands::status().recording;
    recording.running = action == RecordingAction::start;
    return recording;
  }

  Result<PreviewJpeg> preview() override {
    const std::lock_guard lock(mutex_);
    ++preview_calls_;
    return preview_;
  }
  void set_preview(Result<PreviewJpeg> preview) {
    const std::lock_guard lock(mutex_);
    preview_ = std::move(preview);
  }
  int preview_calls() const {
    const std::lock_guard lock(mutex_);
    return preview_calls_;
  }

  EstimatorKind kind_ = EstimatorKind::panorama;
  std::optional<double> lux_;
  Vec3d normal_;
  std::optional<RecordingAction> action_;

 private:
  mutable std::mutex mutex_;
  EstimatorConfig config_;
  Result<PreviewJpeg> preview_ = Status(StatusCode::failed_precondition, "no pictures");
  int preview_calls_ = 0;
};

}  // namespace lightwell::test
