// The thread that takes brackets from the slot, estimates descriptors and publishes them.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <lightwell/commands.hpp>

#include "app/bracket_slot.hpp"
#include "app/governor.hpp"
#include "camera/frame_recorder.hpp"
#include "estimate/estimator.hpp"
#include "link/link.hpp"

namespace lightwell {

class Pipeline final : public Commands {
 public:
  /// `identity`: the probe's status; its counters are ignored. `budget_ms`: time limit of an estimate including
  /// encoding; config.setting is then the richest setting. 0: no limit.
  Pipeline(StatusSnapshot identity, std::unique_ptr<Estimator> estimator, const EstimatorConfig& config,
           double budget_ms = 0);
  ~Pipeline() override;

  /// Add links between construction and start(); they need this object as their Commands.
  Publisher& publisher() { return publisher_; }
  /// The sink for the camera's frames.
  FrameSink& sink() { return slot_; }
  /// Includes the recorder's counters in the status; may be null.
  void watch_recorder(const FrameRecorder* recorder) { recorder_ = recorder; }

  [[nodiscard]] Status start();
  /// Ends the thread, then the links. Call it after the camera has stopped.
  void stop();

  struct Health {
    std::string last_error;  ///< The last error of the estimator or the encoder; empty if there was none.
    Setting setting;         ///< For the next estimate.
    /// Median duration, ms, when even the cheapest setting was first found to exceed the budget; nullopt otherwise.
    std::optional<double> over_budget_ms;
  };
  [[nodiscard]] Health health() const;

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
  void update_governor(double ms);

  const StatusSnapshot identity_;
  BracketSlot slot_;
  Publisher publisher_;
  std::unique_ptr<Estimator> estimator_;
  const EstimatorKind kind_;
  Governor governor_;  ///< Used by the thread only.
  Setting used_;       ///< The estimator's present setting; used by the thread only.
  const FrameRecorder* recorder_ = nullptr;
  std::thread thread_;
  std::atomic<std::uint64_t> estimates_{0}, failed_{0};

  /// Guards the members below; held only for copies.
  mutable std::mutex mutex_;
  EstimatorConfig config_;
  RadianceScale scale_;
  bool config_changed_ = false, scale_changed_ = false, recovery_changed_ = false;
  Descriptor newest_;
  double newest_factor_ = 1;                  ///< The scale factor of `newest_`.
  std::vector<ClippedLight> newest_clipped_;  ///< The clipped lights of `newest_`.
  Recovery recovery_;
  bool has_newest_ = false;
  Health health_;
  Governor::Counts governor_counts_;
};

}  // namespace lightwell
