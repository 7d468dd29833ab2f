// Groups of frames of the campaign of the error bound (README.md): a group's number determines scene, lens, sensor,
// exposure, settings, motion and changes of the light.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "measure/campaign_scene.hpp"

namespace lightwell::measure {

inline constexpr int kGroupFrames = 50;

/// A name and a format; rgb8_linear has the same format as rgb8 and another response.
struct SensorChoice {
  std::string_view name;
  PixelFormat format;
  ResponseCurve::Kind response;
};

/// Exposure times relative to those of Camera::bracket_of_three(), in which nothing saturates.
enum class ExposureKind { right, over, under };
[[nodiscard]] std::string_view to_string(ExposureKind kind);

struct GroupFrame {
  LightState light;
  double yaw_rad = 0;          ///< About the world's +Y, after the probe's tilt.
  bool lamps_changed = false;  ///< A lamp was switched or moved since the last frame.
};

struct Group {
  std::uint32_t number = 0;
  CampaignScene scene;
  std::string_view lens;
  int width = 0, height = 0;  ///< Of each lens's picture, pixels.
  SensorChoice sensor;
  ExposureKind exposure = ExposureKind::right;
  double exposure_factor = 1;
  int exposures = 1;  ///< 1, or 3: a bracket.
  EstimatorConfig config;
  Quat tilt;  ///< R_world_probe at yaw 0.
  double turn_deg_per_s = 0;
  std::vector<GroupFrame> frames;

  /// The rig of this lens and sensor.
  [[nodiscard]] RigParameters rig() const;
  /// Frames in which everything is read once: Group::config's, 1 where frames are read whole.
  [[nodiscard]] int rotation_length() const;
};

/// The same on every machine. not_found where the real panoramas are missing.
[[nodiscard]] Result<Group> draw_group(std::uint32_t number);

}  // namespace lightwell::measure
