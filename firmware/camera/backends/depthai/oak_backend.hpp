// The backend over an OAK device: assigns frames to the bracket, computes their times, and lends them.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "camera/backend.hpp"
#include "camera/backends/depthai/oak_device.hpp"
#include "camera/bracket_cycle.hpp"

namespace lightwell::oak {

/// The device runs from open() until the backend is destroyed; between start() and stop() its frames are pushed. The
/// frames are in memory of this process, which is lent without a copy; raw frames are unpacked into slots. After a
/// disconnection, a reconnection is tried once a second.
class OakBackend final : public CameraBackend, public FrameOwner {
 public:
  OakBackend(OakOptions options, std::unique_ptr<OakDevice> device)
      : options_(std::move(options)), device_(std::move(device)) {}
  ~OakBackend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override;
  [[nodiscard]] Status start(FrameSink& sink) override;
  void stop() override;
  [[nodiscard]] State state() const override { return state_; }

  void release(int slot) override;

 private:
  struct Slot {
    OakPicture picture;                ///< Keeps the memory while it is lent.
    std::vector<std::uint16_t> words;  ///< Unpacked pixels of raw frames.
  };

  [[nodiscard]] Status measure_stream();
  [[nodiscard]] Status check(const OakPicture& picture) const;
  void run(FrameSink& sink);
  [[nodiscard]] bool stopping();
  void discard_waiting();
  [[nodiscard]] bool reconnect();
  void handle(OakPicture picture, FrameSink& sink);
  [[nodiscard]] std::optional<int> free_slot();
  void request_next_exposure();

  const OakOptions options_;
  const std::unique_ptr<OakDevice> device_;
  CameraInfo info_;
  bool open_ = false;
  Duration interval_;

  std::atomic<State> state_{State::idle};
  std::thread thread_;
  std::mutex mutex_;  ///< Guards the three members below.
  bool stopping_ = false;
  std::vector<int> free_, returned_;
  std::condition_variable wake_;
  std::vector<Slot> slots_;

  // Owned by the thread while it runs
  std::optional<ReportedCycle> cycle_;  ///< Set for a single exposure.
  std::optional<HeldCycle> held_;       ///< Set for a bracket.
  std::int64_t last_sequence_ = -1;
  ProbeTime last_mid_;
};

}  // namespace lightwell::oak
