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
struct ControlRange {
  double min = 0, max = 0;
  std::optional<double> preset;  ///< What the camera takes of itself, where it says.
};

/// Of a camera's controls those that decide what a pixel's value means. Nothing: not offered.
struct SupportedControls {
  bool manual_exposure = false;            ///< AeEnable.
  bool manual_white_balance = false;               ///< AwbEnable.
  bool manual_focus = false;               ///< AfMode.
  std::optional<ControlRange> exposure_us;  ///< ExposureTime.
  std::optional<ControlRange> gain;         ///< AnalogueGain.
  std::optional<ControlRange> colour_gain;  ///< ColourGains, each of the two.
  std::optional<ControlRange> duration_us;  ///< FrameDurationLimits.
};

struct SelectedControls {
  bool manual_exposure = false, manual_white_balance = false, manual_focus = false;
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
[[nodiscard]] Result<SelectedControls> choose_controls(const SupportedControls& offered, const LibcameraOptions& asked);

}  // namespace lightwell::libcam
