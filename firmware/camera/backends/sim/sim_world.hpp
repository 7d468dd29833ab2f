// The configuration of a simulated camera, before rendering: its options, from the URI and the configuration; scene,
// rig and the plan of pictures, which follow from them.
//   sim:SCENE?rig=pair&sensor=rgb_f32&yaw_rate=30deg/s&lamp_switch=1.0s&frames=32&seed=1&row_readout=0us
//            &exposure=1ms,8ms&gain=1&flicker=100hz&depth=0.3   (on one line)
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/sim/frame_ring.hpp"
#include "imaging/uri.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"

namespace lightwell {

struct SimOptions {
  std::string scene;                                 ///< A name or a path: sim/panorama.hpp's scene_path().
  std::string rig = "pair";                          ///< sim/rigs.hpp's make_rig().
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

struct SimWorld {
  /// With default exposures and the height of an equirectangular picture (half the width) filled in, and the frame rate
  /// reduced to what the longest exposure and the readout allow.
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

}  // namespace lightwell
