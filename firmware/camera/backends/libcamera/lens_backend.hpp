// The backend over one or two lenses: assigns frames to the exposure cycle, pairs them, computes their times, and lends
// them.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "camera/backend.hpp"
#include "camera/backends/libcamera/cycle_alignment.hpp"
#include "camera/backends/libcamera/frame_pairs.hpp"
#include "camera/backends/libcamera/lens.hpp"
#include "camera/backends/libcamera/mailbox.hpp"
#include "camera/bracket_cycle.hpp"

namespace lightwell::libcam {

/// Pushes from one thread of its own, which also queues idle buffers to the cameras. open() runs the cameras briefly
/// (camera_capabilities.hpp). If a camera is disconnected, or delivers nothing for seconds, the state is lost; all
/// lenses stop, and start again once it is back.
class LensBackend final : public CameraBackend, public FrameOwner {
 public:
  /// One or two lenses, with the indices 0 and 1, that post to `mailbox`.
  LensBackend(LibcameraOptions options, std::vector<std::unique_ptr<Lens>> lenses, std::shared_ptr<Mailbox> mailbox)
      : options_(std::move(options)), mailbox_(std::move(mailbox)), lenses_(std::move(lenses)) {}
  ~LensBackend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override;
  [[nodiscard]] Status start(FrameSink& sink) override;
  void stop() override;
  [[nodiscard]] State state() const override { return state_; }

  void release(int slot) override { mailbox_->give_back(slot); }

 private:
  /// A completed frame that is not delivered yet; indexed by buffer.
  struct Candidate {
    ProbeTime stamp, begin, mid, arrival;
    double exposure_s = 0, gain = 1;
    std::uint64_t sequence = 0;
    bool waits = false;  ///< Waits for its counterpart.
  };
  /// A lent frame; indexed by slot.
  struct LentFrame {
    std::array<std::shared_ptr<const PictureMemory>, kMaxLenses> memory;
    std::array<int, kMaxLenses> buffer{}, session{};
  };
  using Buffers = std::array<int, kMaxLenses>;
  using Clock = Mailbox::Clock;

  [[nodiscard]] std::size_t count() const { return lenses_.size(); }
  [[nodiscard]] std::size_t bracket() const { return info_.exposure_s.size(); }
  /// Whether each exposure is held until its frame has come (HeldCycle); otherwise every request has the next one.
  [[nodiscard]] bool holds_exposure() const {
    return bracket() > 1 && (!reports_exposure_ || (count() > 1 && !distinct_));
  }
  /// Whether two cameras run through the cycle in parallel (CycleAlignment).
  [[nodiscard]] bool aligns() const { return bracket() > 1 && count() > 1 && !holds_exposure(); }

  [[nodiscard]] Status acquire_all();
  [[nodiscard]] Status probe_lenses();
  [[nodiscard]] CameraInfo describe() const;

  void run(FrameSink& sink);
  [[nodiscard]] Status begin();
  void take_back(int slot);
  void reconnect_cameras();
  void mark_lost(std::size_t lens);
  void refill();
  void handle(const Completion& completion, FrameSink& sink);
  void deliver(const Buffers& buffers, FrameSink& sink);
  /// Whether both frames of a pair have the same exposure; otherwise shifts the second camera's cycle.
  [[nodiscard]] bool aligned(const Candidate& first, const Candidate& second);
  /// Index and sequence number of a frame (two cameras: of a pair), or empty if it must be dropped: its exposure is not
  /// in the cycle, is not the held one, or has not settled, or no slot is free. `first`: the part of lens 0. `begin`:
  /// when the exposure of the earlier part began. Advances the cycle.
  [[nodiscard]] std::optional<CyclePlace> assign_place(const Candidate& first, ProbeTime begin, bool has_free_slot);
  void drop(const Buffers& buffers);

  const LibcameraOptions options_;
  const std::shared_ptr<Mailbox> mailbox_;
  Mailbox::Events events_;
  const std::vector<std::unique_ptr<Lens>> lenses_;
  CameraInfo info_;
  bool open_ = false;

  // Measured by open()
  bool reports_exposure_ = false;
  bool distinct_ = true;  ///< All exposures of the cycle differ.
  bool strict_ = true;    ///< False: the camera could not set the single exposure exactly; any report is accepted.
  double gain_ = 1;
  Duration interval_;

  std::atomic<State> state_{State::idle};
  std::thread thread_;
  std::vector<LentFrame> lent_frames_;
  std::vector<int> free_slots_;

  // Owned by the thread while it runs
  bool running_ = false;  ///< All cameras are started.
  std::array<std::vector<Candidate>, kMaxLenses> candidates_;
  std::array<SensorClock, kMaxLenses> clocks_;
  std::optional<FramePairer> pairs_;
  std::optional<ReportedCycle> cycle_;
  std::optional<HeldCycle> held_;
  std::array<bool, kMaxLenses> exposure_requested_{}, gone_{};
  std::array<int, kMaxLenses> failures_{};
  std::array<Clock::time_point, kMaxLenses> quiet_since_{};
  std::optional<CycleAlignment> alignment_;
  std::array<std::size_t, kMaxLenses> next_exposure_{};
  Clock::time_point pause_until_, retry_at_;
  ProbeTime last_mid_;
};

}  // namespace lightwell::libcam
