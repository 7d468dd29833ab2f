// What becomes of an OAK camera's frames: their place in the bracket, their time, and who has them lent.
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

/// The device runs from open() until the backend dies; start() and stop() say whether its frames are handed on. Its
/// frames are memory of this process's, which is lent as it is; raw ones are unpacked into slots. A device that is gone
/// is looked for once a second.
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
    OakPicture picture;                ///< Held while lent.
    std::vector<std::uint16_t> words;  ///< Of raw pictures.
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
  std::mutex mutex_;  ///< Guards the three below.
  bool stopping_ = false;
  std::vector<int> free_, returned_;
  std::condition_variable wake_;
  std::vector<Slot> slots_;

  // The thread's own while it runs
  std::optional<ReportedCycle> cycle_;  ///< Of one exposure.
  std::optional<HeldCycle> held_;       ///< Of a bracket.
  std::int64_t last_sequence_ = -1;
  ProbeTime last_mid_;
};

}  // namespace lightwell::oak
