// The simulated camera: panoramas rendered through a lens and a sensor model, delivered as frames. Consumers receive
// Frame and CameraInfo as from any camera; evaluation code gets the ground truth from the public accessors below.
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
#include "imaging/uri.hpp"

namespace lightwell {

/// Pushes from one thread, at absolute times (ticks) of CLOCK_MONOTONIC. A late thread skips ticks, and a tick without
/// a free buffer is lost: the sequence shows both. With a frame rate of 0 there are no ticks: a frame is pushed as soon
/// as a buffer is free and the sink has space.
///
/// mid_exposure = tick - exposure / 2 - rows / 2 * readout, with the scheduled tick: late delivery does not shift it.
/// Without ticks the time of delivery and the longest exposure replace tick and exposure. The ideal sensor (rgb_f32)
/// has no exposure time: its exposure_s is a scale factor.
class SimBackend final : public CameraBackend, public FrameOwner {
 public:
  explicit SimBackend(SimOptions options);
  ~SimBackend() override;

  /// Progress callback of open(), which takes seconds for a long ring. Call before open().
  void on_progress(RenderProgress progress) { progress_ = std::move(progress); }

  /// Loads the panorama and renders the ring. Errors of scene_path(), load_panorama(), make_rig(); resource_exhausted
  /// if the frames are too large. An equirectangular picture becomes width x width/2; the frame rate is reduced to what
  /// the longest exposure and the readout allow.
  [[nodiscard]] Result<CameraInfo> open() override;
  [[nodiscard]] Status start(FrameSink& sink) override;
  void stop() override;
  [[nodiscard]] State state() const override { return state_; }

  /// After open(): numbers of replaced values in the panorama file.
  [[nodiscard]] const sim::SanitizeCounts& sanitize_counts() const { return world_->sanitize_counts; }
  /// After open(): the scene, for ground truth by Scene::state_at() and Scene::radiance().
  [[nodiscard]] const sim::Scene& scene() const { return world_->scene; }
  /// Index for Scene::state_at() of the frame with this sequence number.
  [[nodiscard]] std::uint64_t scene_index(std::uint64_t sequence) const { return ring_.plan().scene_index(sequence); }

  void release(int slot) override;

 private:
  [[nodiscard]] CameraInfo describe() const;
  void run(FrameSink& sink, const std::stop_token& stop);
  void push_frame(FrameSink& sink, std::uint64_t sequence, ProbeTime due);

  SimOptions options_;  ///< The effective options once open() has succeeded.
  RenderProgress progress_;
  std::unique_ptr<SimWorld> world_;  ///< Set once open() has succeeded.
  FrameRing ring_;

  std::atomic<State> state_{State::idle};
  std::thread thread_;
  std::stop_source stop_;  ///< Ends the thread's wait in FrameSink::wait_for_space().
  std::mutex mutex_;       ///< Guards the two members below.
  bool stopping_ = false;
  int lent_ = 0;
  std::condition_variable wake_;
  /// Continues after a restart, so that no number is repeated. Owned by the thread while it runs.
  std::uint64_t next_sequence_ = 0;
};

/// invalid_argument for an invalid URI or configuration.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_sim_backend(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell
