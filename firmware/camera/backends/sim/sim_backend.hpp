// The simulated camera: panoramas rendered through a lens and a sensor model, delivered as frames. Consumers receive
// Frame and CameraInfo as from any camera; evaluation code gets the ground truth from the public accessors below.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stop_token>

#include "camera/backends/sim/sim_world.hpp"
#include "camera/threaded_backend.hpp"

namespace lightwell {

/// Pushes from one thread, at absolute times (ticks) of CLOCK_MONOTONIC. A late thread skips ticks, and a tick without
/// a free buffer is lost: the sequence shows both. With a frame rate of 0 there are no ticks (README.md).
/// mid_exposure = tick - exposure / 2 - rows / 2 * readout; without ticks the time of delivery and the longest exposure
/// replace tick and exposure.
class SimBackend final : public ThreadedBackend, public FrameOwner {
 public:
  explicit SimBackend(SimOptions options) : ThreadedBackend("sim"), options_(std::move(options)) {}
  ~SimBackend() override { stop(); }

  /// Progress callback of open(), which takes seconds for a long ring. Call before open().
  void on_progress(RenderProgress progress) { progress_ = std::move(progress); }

  /// Loads the panorama and renders the ring. Errors of make_sim_world().
  [[nodiscard]] Result<CameraInfo> open() override;

  /// After open(): numbers of replaced values in the panorama file.
  [[nodiscard]] const sim::SanitizeCounts& sanitize_counts() const { return world_->sanitize_counts; }
  /// After open(): the scene, for ground truth by Scene::state_at() and Scene::radiance().
  [[nodiscard]] const sim::Scene& scene() const { return world_->scene; }
  /// Index for Scene::state_at() of the frame with this sequence number.
  [[nodiscard]] std::uint64_t scene_index(std::uint64_t sequence) const { return ring_.plan().scene_index(sequence); }

  void release(int slot) override;

 private:
  [[nodiscard]] CameraInfo describe() const;
  [[nodiscard]] bool is_open() const override { return world_ != nullptr; }
  void run(FrameSink& sink, const std::stop_token& stop) override;
  void push_frame(FrameSink& sink, std::uint64_t sequence, ProbeTime due);

  SimOptions options_;  ///< The effective options once open() has succeeded.
  RenderProgress progress_;
  std::unique_ptr<SimWorld> world_;  ///< Set once open() has succeeded.
  FrameRing ring_;

  std::mutex mutex_;  ///< Guards lent_.
  int lent_ = 0;
  std::condition_variable_any wake_;
  /// Continues after a restart, so that no number is repeated. Owned by the thread while it runs.
  std::uint64_t next_sequence_ = 0;
};

/// invalid_argument for an invalid URI or configuration.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_sim_backend(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell
