// The simulated camera: real panoramas, rendered through a lens and a sensor, delivered as frames.
// It is a camera, nothing more: what it knows leaves it as Frame and CameraInfo. Judges, who must
// know the truth, ask the public accessors below.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "camera/backend.hpp"
#include "camera/backends/sim/frame_ring.hpp"
#include "camera/backends/sim/sim_options.hpp"
#include "camera/backends/sim/sim_world.hpp"
#include "camera/uri.hpp"

namespace lightwell {

/// Pushes from one thread that is paced on CLOCK_MONOTONIC by absolute times. A thread that comes
/// late skips ticks, and a tick without a frame to lend is lost: the sequence shows both. With a
/// frame rate of 0 there are no ticks: the next frame comes as soon as one can be lent and the sink has
/// room for it.
///
/// mid_exposure = tick - exposure / 2 - rows / 2 * readout, the tick being when the frame is due:
/// a thread that delivers late has not exposed late. Without ticks, delivery counts and the longest
/// exposure. The ideal sensor (rgb_f32) takes no time to expose: its exposure_s is a scale.
class SimBackend final : public CameraBackend, public FrameOwner {
 public:
  explicit SimBackend(SimOptions options);
  ~SimBackend() override;

  /// Who wants to know how far open() has come: it takes seconds for a long ring. Before open().
  void on_progress(RenderProgress progress) { progress_ = std::move(progress); }

  /// Loads the panorama and renders the ring. Errors of scene_path(), load_panorama(), make_rig();
  /// resource_exhausted where the frames are too large. An equirectangular picture becomes width x
  /// width/2; the rate falls to what the longest exposure and the readout allow.
  [[nodiscard]] Result<CameraInfo> open() override;
  [[nodiscard]] Status start(FrameSink& sink) override;
  void stop() override;
  [[nodiscard]] State state() const override { return state_; }

  /// After open(): what had to be replaced in the panorama's file.
  [[nodiscard]] const sim::SanitizeCounts& sanitize_counts() const { return world_->sanitize_counts; }
  /// After open(): the world, for Scene::state_at() and Scene::radiance().
  [[nodiscard]] const sim::Scene& scene() const { return world_->scene; }
  /// The index for Scene::state_at() of the frame with this number.
  [[nodiscard]] std::uint64_t scene_index(std::uint64_t sequence) const { return ring_.plan().scene_index(sequence); }

  void release(int slot) override;

 private:
  [[nodiscard]] CameraInfo describe() const;
  void run(FrameSink& sink, const std::stop_token& stop);
  void push_frame(FrameSink& sink, std::uint64_t sequence, ProbeTime due);

  SimOptions options_;  ///< As in force, once open() has succeeded.
  RenderProgress progress_;
  std::unique_ptr<SimWorld> world_;  ///< Set once open() has succeeded.
  FrameRing ring_;

  std::atomic<State> state_{State::idle};
  std::thread thread_;
  std::stop_source stop_;  ///< Of the thread, while it waits in the sink.
  std::mutex mutex_;       ///< Guards the two below.
  bool stopping_ = false;
  int lent_ = 0;
  std::condition_variable wake_;
  /// Goes on after a restart: no number comes twice. The thread's own while it runs.
  std::uint64_t next_sequence_ = 0;
};

/// invalid_argument for a URI or a configuration that can never work.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_sim_backend(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell
