// From the camera's frames to published descriptors: the slot that collects brackets, and the thread that takes them.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include <lightwell/commands.hpp>
#include <lightwell/plane_codec.hpp>

#include "app/governor.hpp"
#include "app/preview.hpp"
#include "camera/frame_recorder.hpp"
#include "estimate/estimator.hpp"
#include "imaging/frame.hpp"
#include "link/link.hpp"
#include "link/recordings/probe_recorder.hpp"

namespace lightwell {

/// The frames of one bracket in the order of exposure. Move-only, like the frames.
class Bracket {
 public:
  void clear() {
    while (size_ > 0) frames_[--size_] = Frame();
  }
  /// Ignores frames beyond kMaxBracket.
  void add(Frame frame) {
    if (size_ < frames_.size()) frames_[size_++] = std::move(frame);
  }
  [[nodiscard]] std::span<const Frame> frames() const { return {frames_.data(), size_}; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

  Bracket() = default;
  Bracket(Bracket&& o) noexcept { *this = std::move(o); }
  Bracket& operator=(Bracket&& o) noexcept {
    clear();
    for (std::size_t i = 0; i < o.size_; ++i) frames_[i] = std::move(o.frames_[i]);
    size_ = o.size_;
    o.size_ = 0;
    return *this;
  }

 private:
  std::array<Frame, kMaxBracket> frames_;
  std::size_t size_ = 0;
};

/// Collects frames into brackets, on the camera's thread, and keeps the newest complete one until it is taken.
class BracketSlot final : public FrameSink {
 public:
  void push(Frame frame) override;
  /// Waits until the complete bracket was taken; true then. False if `stop` was requested first; after close() it waits
  /// for `stop`.
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override;

  /// Waits for a complete bracket; false once close() was called.
  [[nodiscard]] bool take(Bracket& out);
  enum class Taken : std::uint8_t { bracket, nothing, closed };
  /// The same with a time limit: nothing if there was no bracket until then.
  [[nodiscard]] Taken take_before(std::chrono::steady_clock::time_point limit, Bracket& out);
  /// Ends take() permanently and releases all frames.
  void close();

  struct Counts {
    std::uint64_t frames = 0, lost = 0, dropped = 0, incomplete = 0;
  };
  [[nodiscard]] Counts counts() const;

 private:
  /// Unlocks where there is a bracket.
  [[nodiscard]] Taken take_locked(std::unique_lock<std::mutex>& lock, Bracket& out);
  /// Counts each incomplete bracket once. A bracket is identified by the sequence number of its first exposure.
  void count_incomplete(std::uint64_t first_sequence);

  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::condition_variable_any space_available_;  ///< Supports a stop_token.
  Bracket filling_, whole_;
  Counts counts_;
  std::uint64_t last_sequence_ = 0;
  std::optional<std::uint64_t> last_incomplete_;
  bool closed_ = false;
};

/// The thread that takes brackets from the slot, estimates descriptors and publishes them. The estimator's captured
/// plane, if it has one, is published after the first bracket that gave one, and then after the first bracket of every
/// second; what later brackets of a second have changed is published at its end if no other bracket follows.
class Pipeline final : public Commands {
 public:
  struct Limits {
    double budget_ms = 0;  ///< Time of an estimate including encoding; 0: no limit.
    double max_bound = 0;  ///< Bound of a descriptor; 0: no limit. The time limit has precedence.
  };
  /// `identity`: the probe's status; its counters are ignored. With a limit, config.setting is the richest setting.
  /// `planes`: of captured planes.
  Pipeline(StatusSnapshot identity, std::unique_ptr<Estimator> estimator, const EstimatorConfig& config,
           Limits limits = {0, 0}, const PlaneEncoderOptions& planes = {});
  ~Pipeline() override;

  /// Add links between construction and start(); they need this object as their Commands.
  Publisher& publisher() { return publisher_; }
  /// The sink for the camera's frames.
  FrameSink& sink() { return slot_; }
  /// Includes the recorder's counters in the status; may be null.
  void watch_recorder(const FrameRecorder* recorder) { recorder_ = recorder; }
  /// Lets clients record what is published; before start(). May be null, and then they cannot.
  void set_recordings(ProbeRecorder* recordings);
  /// Lets clients have pictures of the camera's frames; before start(). May be null, and then they cannot.
  void set_preview(Preview* preview) { preview_ = preview; }
  /// Reports it to clients; before start().
  void set_calibration(CalibrationSummary calibration) { calibration_ = std::move(calibration); }

  /// Reports it to clients; no value: not known. Any thread.
  void set_temperature(std::optional<float> temperature_c);

  [[nodiscard]] Status start();
  /// Ends the thread, then the links. Call it after the camera has stopped.
  void stop();

  struct Health {
    std::string last_error;  ///< The last error of the estimator or the encoder; empty if there was none.
    Setting setting;         ///< For the next estimate.
    /// Median duration, ms, when even the cheapest setting was first found to exceed the budget; nullopt otherwise.
    std::optional<double> over_budget_ms;
    /// Median bound when even the richest setting was first found to exceed max_bound; nullopt otherwise.
    std::optional<double> over_bound;
  };
  [[nodiscard]] Health health() const;

  // Commands
  [[nodiscard]] StatusSnapshot status() const override;
  [[nodiscard]] EstimatorConfig estimator() const override;
  [[nodiscard]] EstimatorKind estimator_kind() const override { return kind_; }
  [[nodiscard]] Status update_estimator(const EstimatorUpdate& update) override;
  [[nodiscard]] Result<double> report_lux(double lux, Vec3d normal) override;
  [[nodiscard]] CalibrationSummary calibration() const override { return calibration_; }
  [[nodiscard]] Result<RecordingStatus> control_recording(RecordingAction action) override;
  [[nodiscard]] Result<PreviewJpeg> preview() override;

 private:
  void run();
  void configure_estimator();
  /// Waits for a bracket, and publishes the plane when it is due. False once the slot was closed.
  [[nodiscard]] bool take(Bracket& out);
  /// If a second has passed since the last time.
  void publish_plane();
  void keep_error(const Status& status);
  /// Stores the descriptor for report_lux(); unchanged when the call returns.
  void keep_newest(Descriptor& descriptor);
  [[nodiscard]] Result<double> recover_clipped_from_lux(double lux, Vec3d normal);
  /// The cheaper of the points that the governors choose.
  [[nodiscard]] OperatingPoint point() const;
  void update_governors(double ms, double bound);

  const StatusSnapshot identity_;
  CalibrationSummary calibration_;
  BracketSlot slot_;
  Publisher publisher_;
  std::unique_ptr<Estimator> estimator_;
  const EstimatorKind kind_;
  Governor time_governor_, bound_governor_;  ///< Used by the thread only.
  OperatingPoint used_;                      ///< Of the estimator; used by the thread only.
  /// Of the last published plane; used by the thread only.
  std::optional<std::chrono::steady_clock::time_point> plane_published_;
  bool plane_changed_ = false;  ///< There were brackets since then; used by the thread only.
  const FrameRecorder* recorder_ = nullptr;
  ProbeRecorder* recordings_ = nullptr;
  Preview* preview_ = nullptr;
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
  std::optional<float> temperature_c_;
};

}  // namespace lightwell
