// A simulated camera behind the Lens interface: it exposes at its own rate, applies exposures with a delay as sensors
// do, optionally reports them, and can be unplugged and plugged in again. The true exposure and its time are written
// into the pixels, so that a test can compare them with the metadata of the backend.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "camera/backends/libcamera/lens.hpp"
#include "imaging/frame.hpp"

namespace lightwell::libcam {

struct SimulatedCameraOptions {
  std::string id = "sim";
  std::chrono::microseconds interval{10'000};
  std::chrono::microseconds phase{0};  ///< Offset of its frames relative to other cameras'.
  int delay = 2;  ///< Frames from the request of an exposure to the first frame that begins with it.
  bool reports_exposure = true;
  bool gives_frames = true;
  int width = 32, height = 16;
  double exposure_factor = 1;  ///< Actual exposure relative to the requested one.
  int depth = 4;               ///< Length of its queue of buffers.
  int lost_every = 0;          ///< One of this many frames is lost; 0: none.
};

/// The device, which outlives the lenses.
class SimulatedCamera {
 public:
  explicit SimulatedCamera(SimulatedCameraOptions options) : options_(std::move(options)) {}
  [[nodiscard]] const SimulatedCameraOptions& options() const { return options_; }
  /// Number of the device, which changes each time it is plugged in; 0: unplugged.
  [[nodiscard]] int device() const { return device_; }
  void unplug();
  void plug();
  void watch(std::shared_ptr<Mailbox> mailbox);

 private:
  void tell();
  const SimulatedCameraOptions options_;
  std::atomic<int> device_{1};
  int last_device_ = 1;
  std::mutex mutex_;
  std::vector<std::weak_ptr<Mailbox>> mailboxes_;
};

/// The ground truth in the pixels of a frame.
struct Truth {
  std::uint64_t magic = 0;
  std::int64_t begin_ns = 0, end_ns = 0;  ///< Start and end of the exposure.
  std::uint64_t number = 0;
  std::int32_t exposure_us = 0;
  std::int32_t device = 0;
};
inline constexpr std::uint64_t kTruthMagic = 0x6c69676874776c6c;
[[nodiscard]] Truth truth_of(const View& view);

class SimulatedLens final : public Lens {
 public:
  SimulatedLens(std::shared_ptr<SimulatedCamera> camera, int lens, std::shared_ptr<Mailbox> mailbox);
  ~SimulatedLens() override { release(); }

  [[nodiscard]] Status acquire(const LibcameraOptions& options, int lendable) override;
  void release() override;
  [[nodiscard]] bool acquired() const override { return device_ != 0; }
  [[nodiscard]] bool present() const override { return acquired() && camera_->device() == device_; }
  [[nodiscard]] Status start() override;
  void stop() override;
  [[nodiscard]] const std::string& id() const override { return camera_->options().id; }
  [[nodiscard]] const std::string& model() const override { return camera_->options().id; }
  [[nodiscard]] const PictureLayout& layout() const override { return layout_; }
  [[nodiscard]] const SelectedControls& controls() const override { return controls_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return controls_.notes; }
  [[nodiscard]] std::shared_ptr<const PictureMemory> memory() const override;
  [[nodiscard]] int buffers() const override { return static_cast<int>(pictures_.size()); }
  [[nodiscard]] int session() const override { return session_; }
  [[nodiscard]] bool full() const override;
  [[nodiscard]] bool queue(std::int32_t exposure_us) override;
  [[nodiscard]] Picture collect(int buffer) override;
  void make_idle(int buffer) override;

 private:
  struct Memory;
  void run();
  void expose(std::uint64_t tick, std::chrono::steady_clock::time_point end);

  const std::shared_ptr<SimulatedCamera> camera_;
  const int lens_;
  const std::shared_ptr<Mailbox> mailbox_;
  PictureLayout layout_;
  SelectedControls controls_;
  int device_ = 0, session_ = 0;
  std::shared_ptr<Memory> memory_;

  mutable std::mutex mutex_;  ///< Guards the members below.
  std::condition_variable wake_;
  bool stopping_ = false;
  std::vector<Picture> pictures_;
  std::vector<int> idle_, queued_;
  std::int32_t asked_us_ = 0;
  std::array<std::int32_t, 16> in_force_us_{};  ///< Exposure requested at each of the last ticks.
  std::uint64_t number_ = 0;
  std::thread thread_;
};

}  // namespace lightwell::libcam
