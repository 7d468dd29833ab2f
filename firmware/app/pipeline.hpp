// The four rooms in a row: frames from the slot, through the estimator, to the publisher. One thread of its own.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <lightwell/status.hpp>

#include "app/bracket_slot.hpp"
#include "app/governor.hpp"
#include "camera/frame_recorder.hpp"
#include "estimate/estimator.hpp"
#include "link/publisher.hpp"

namespace lightwell {

/// Who the probe says it is.
struct ProbeIdentity {
  std::string name;
  std::uint32_t probe_id = 0, calibration_id = 0;
  std::string version, camera;
  std::optional<UncertainPose> T_world_probe{};  ///< Where it hangs, where it knows.
};

class Pipeline final : public Commands {
 public:
  /// `budget_ms`: what an estimate may take from the estimator's start to its encoded bytes; config.setting is the
  /// richest setting then. 0: no budget.
  Pipeline(ProbeIdentity identity, std::unique_ptr<Estimator> estimator, const EstimatorConfig& config,
           double budget_ms = 0);
  ~Pipeline() override;

  /// Links want the Commands, so they come after construction and before start().
  Publisher& publisher() { return publisher_; }
  /// Where the camera pushes.
  FrameSink& sink() { return slot_; }
  /// For the counters; may be null.
  void watch_recorder(const FrameRecorder* recorder) { recorder_ = recorder; }

  [[nodiscard]] Status start();
  /// The camera has stopped. Ends the thread, then the links.
  void stop();

  /// The last refusal of the estimator or the encoder; empty where there was none.
  [[nodiscard]] std::string last_error() const;

  /// With which the next estimate will be made.
  [[nodiscard]] Setting setting() const;
  /// What an estimate typically took, ms, when even the cheapest setting was found to exceed the budget.
  [[nodiscard]] std::optional<double> over_budget_ms() const;

  // Commands
  [[nodiscard]] StatusSnapshot status() const override;
  [[nodiscard]] EstimatorConfig estimator() const override;
  [[nodiscard]] EstimatorKind estimator_kind() const override { return kind_; }
  [[nodiscard]] Status update_estimator(const EstimatorUpdate& update) override;
  [[nodiscard]] Result<double> report_lux(double lux, Vec3d normal) override;

 private:
  void run();
  void configure_estimator();
  [[nodiscard]] Result<double> recover_clipped_from_lux(double lux, Vec3d normal);
  void measured(double ms);

  const ProbeIdentity identity_;
  BracketSlot slot_;
  Publisher publisher_;
  std::unique_ptr<Estimator> estimator_;
  const EstimatorKind kind_;
  Governor governor_;  ///< Of the thread.
  Setting used_;       ///< Of the thread: that the estimator has.
  const FrameRecorder* recorder_ = nullptr;
  std::thread thread_;
  std::atomic<std::uint64_t> estimates_{0}, failed_{0};

  /// Guards what commands change and the newest descriptor, held for copies only.
  mutable std::mutex mutex_;
  EstimatorConfig config_;
  RadianceScale scale_;
  bool config_changed_ = false, scale_changed_ = false, recovery_changed_ = false;
  Descriptor newest_;
  double newest_factor_ = 1;                  ///< The scale that `newest_` was made with.
  std::vector<ClippedLight> newest_clipped_;  ///< Those of its lights.
  Recovery recovery_;
  bool has_newest_ = false;
  Setting setting_;
  Governor::Counts governor_counts_;
  std::optional<double> beyond_budget_ms_;
  std::string last_error_;
};

}  // namespace lightwell
