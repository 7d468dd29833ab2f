// The simulated camera: panoramas rendered through a lens and a sensor model, delivered as frames. Consumers receive
// Frame and CameraInfo as from any camera; evaluation code gets the ground truth from the public accessors below.
//   sim:SCENE?rig=pair&sensor=rgb_f32&yaw_rate=30deg/s&lamp_switch=1.0s&frames=32&seed=1&row_readout=0us
//            &exposure=1ms,8ms&gain=1&flicker=100hz&depth=0.3   (on one line)
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "camera/backends/sim/frame_ring.hpp"
#include "imaging/uri.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"

namespace lightwell {

struct SimOptions {
  std::string scene;                                 ///< A name or a path: sim/panorama.hpp's scene_path().
  std::string rig = "pair";                          ///< sim/sensor.hpp's make_rig().
  PixelFormat sensor = PixelFormat::rgb_f32;         ///< As in to_string(PixelFormat).
  double yaw_rate_rad_per_s = 0;                     ///< "30deg/s", "0.5rad/s"; a bare number is deg/s.
  double lamp_switch_s = 0;                          ///< Period after which the lamps switch, s; 0: never.
  std::uint64_t frames = 32;                         ///< Frames after which a moving scene repeats; each costs memory.
  std::uint64_t seed = 1;                            ///< Of the noise.
  double row_readout_s = 0;                          ///< Delay between successive rows.
  sim::MainsFlicker flicker{.hz = 0, .depth = 0.3};  ///< Typical of fluorescent tubes and simple LED lamps.
  CaptureSettings capture;  ///< Exposures and gain; without exposures: one chosen for the scene.
  int width = 0, height = 0;
  double frame_rate = 0;           ///< 1/s; 0: on demand.
  std::vector<std::string> notes;  ///< Former names of parameters in the URI.
};

/// invalid_argument names the parameter, its value and the accepted values.
[[nodiscard]] Result<SimOptions> parse_sim_options(const CameraUri& uri, const CameraConfig& config);

/// "100hz" -> 100. Up to 1000; zero and negative numbers are refused.
[[nodiscard]] Result<double> parse_frequency_hz(std::string_view text);
/// "30deg/s", "-0.5rad/s" -> rad/s.
[[nodiscard]] Result<double> parse_yaw_rate_rad_per_s(std::string_view text);

/// What follows from the options before rendering.
struct SimWorld {
  /// With default exposures and the height of an equirectangular picture, and the frame rate that exposures allow.
  SimOptions options;
  RigParameters rig;
  sim::SanitizeCounts sanitize_counts;  ///< Replaced values of the panorama file.
  RingPlan plan;
  sim::Scene scene;

  /// Inputs of rendering; refers to this object.
  [[nodiscard]] RingSource source() const;
  [[nodiscard]] ExposureTiming timing() const;
};

/// Frames per second of scene time: the camera's frame rate, or 30 if it has none.
[[nodiscard]] double scene_rate(const SimOptions& options);
/// Duration of an exposure, s; 0 for the ideal sensor, whose exposure is a scale factor.
[[nodiscard]] double exposing_s(const SimOptions& options, double exposure_s);

/// Errors of scene_path(), load_panorama(), make_rig(); resource_exhausted if not even one bracket fits into memory.
[[nodiscard]] Result<std::unique_ptr<SimWorld>> make_sim_world(SimOptions options);

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
