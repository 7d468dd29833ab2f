// A small camera with one selectable defect, to show that the conformance suite detects it.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "camera/backend.hpp"

namespace lightwell {

enum class Defect {
  none,
  repeats_sequence,
  stands_still_in_time,
  stamps_the_future,
  stamps_another_clock,
  is_smaller_than_declared,
  has_short_data,
  lacks_a_lens,
  has_no_gain,
  leaves_the_cycle,
  sticks_in_the_cycle,
  pushes_from_two_threads,
  pushes_from_start,
  pushes_after_stop,
  starts_once,
  stays_idle,
  is_never_idle_again,
  writes_to_lent_memory,
  clears_memory_at_stop,
  hides_losses,
  lends_too_few,
  lends_without_end,
  forgets_releases,
  catches_up_in_a_burst,
  never_ends,
  does_not_see_its_loss,
};

/// 100 frames per second, two exposures, two lenses of 16 x 8.
class BrokenCamera final : public CameraBackend, public FrameOwner {
 public:
  /// Ends after `frames`, 0: never. While `gone` is true the device is disconnected.
  BrokenCamera(Defect defect, std::uint64_t frames, const std::atomic<bool>& gone)
      : defect_(defect), frames_(frames), gone_(gone) {}
  ~BrokenCamera() override;

  [[nodiscard]] Result<CameraInfo> open() override;
  [[nodiscard]] Status start(FrameSink& sink) override;
  void stop() override;
  [[nodiscard]] State state() const override { return state_; }
  void release(int slot) override;

 private:
  static constexpr int kWidth = 16, kHeight = 8, kLenses = 2, kRate = 100;
  static constexpr std::array<double, 2> kExposures{0.001, 0.004};
  struct Slot {
    std::array<std::vector<std::byte>, kLenses> pictures;
    enum class Holder { camera, sink } holder = Holder::camera;
  };

  void run(FrameSink& sink);
  [[nodiscard]] bool capture(FrameSink& sink);
  [[nodiscard]] Frame frame_of(int slot);
  [[nodiscard]] FrameInfo next_info();
  [[nodiscard]] int find_free();
  [[nodiscard]] bool is(Defect defect) const { return defect_ == defect; }

  const Defect defect_;
  const std::uint64_t frames_;
  const std::atomic<bool>& gone_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::vector<Slot> slots_;
  std::thread thread_;
  std::atomic<State> state_{State::idle};
  std::uint64_t sequence_ = 0;
  int starts_ = 0;
};

}  // namespace lightwell
