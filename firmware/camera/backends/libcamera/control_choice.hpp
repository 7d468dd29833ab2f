// What a camera is told, chosen from what it says it can do.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/libcamera_options.hpp"

namespace lightwell::libcam {

/// As ControlInfo has it, in the control's own unit.
struct OfferedRange {
  double min = 0, max = 0;
  std::optional<double> preset;  ///< What the camera takes of itself, where it says.
};

/// Of a camera's controls those that decide what a pixel's value means. Nothing: not offered.
struct OfferedControls {
  bool exposure_by_hand = false;            ///< AeEnable.
  bool white_by_hand = false;               ///< AwbEnable.
  bool focus_by_hand = false;               ///< AfMode.
  std::optional<OfferedRange> exposure_us;  ///< ExposureTime.
  std::optional<OfferedRange> gain;         ///< AnalogueGain.
  std::optional<OfferedRange> colour_gain;  ///< ColourGains, each of the two.
  std::optional<OfferedRange> duration_us;  ///< FrameDurationLimits.
};

struct ChosenControls {
  bool exposure_by_hand = false, white_by_hand = false, focus_by_hand = false;
  bool set_exposure = false;              ///< Else the camera offers none, and exposure_us is a guess.
  std::vector<std::int32_t> exposure_us;  ///< The cycle, one entry or more.
  std::optional<float> gain;              ///< Nothing: not offered.
  std::optional<std::array<float, 2>> colour_gains;
  std::optional<std::int64_t> duration_us;
  std::vector<std::string> notes;  ///< What was asked for and is not to be had.

  [[nodiscard]] std::vector<double> exposure_s() const;
  /// In force where the camera does not say of each frame.
  [[nodiscard]] double assumed_gain() const { return gain ? static_cast<double>(*gain) : 1; }
};

/// Values outside a range become its ends; exposures are rounded to the steps that the range has (the pipeline for USB
/// cameras passes on hundreds of microseconds and cuts off the rest). failed_precondition for a bracket on a camera
/// whose exposure cannot be set.
[[nodiscard]] Result<ChosenControls> choose_controls(const OfferedControls& offered, const LibcameraOptions& asked);

}  // namespace lightwell::libcam
