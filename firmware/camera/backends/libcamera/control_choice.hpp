// Chooses the values of a camera's controls from the ranges that it offers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/libcamera_options.hpp"

namespace lightwell::libcam {

/// The range of a ControlInfo, in the control's own unit.
struct ControlRange {
  double min = 0, max = 0;
  std::optional<double> preset;  ///< Default of the camera, if it states one.
};

/// The controls of a camera that affect the meaning of pixel values. Empty or false: not offered.
struct SupportedControls {
  bool manual_exposure = false;             ///< AeEnable.
  bool manual_white_balance = false;        ///< AwbEnable.
  bool manual_focus = false;                ///< AfMode.
  std::optional<ControlRange> exposure_us;  ///< ExposureTime.
  std::optional<ControlRange> gain;         ///< AnalogueGain.
  std::optional<ControlRange> colour_gain;  ///< ColourGains, each of the two.
  std::optional<ControlRange> duration_us;  ///< FrameDurationLimits.
};

struct SelectedControls {
  bool manual_exposure = false, manual_white_balance = false, manual_focus = false;
  bool set_exposure = false;              ///< False: the camera has no ExposureTime, and exposure_us is an assumption.
  std::vector<std::int32_t> exposure_us;  ///< The exposure cycle, one entry or more.
  std::optional<float> gain;              ///< Empty: not offered.
  std::optional<std::array<float, 2>> colour_gains;
  std::optional<std::int64_t> duration_us;
  std::vector<std::string> notes;  ///< Requests that the camera cannot meet.

  [[nodiscard]] std::vector<double> exposure_s() const;
  /// Linear gain of frames whose metadata do not state it.
  [[nodiscard]] double assumed_gain() const { return gain ? static_cast<double>(*gain) : 1; }
};

/// Clamps values to their ranges and rounds exposures to the step of the range (the pipeline for USB cameras truncates
/// to 100 us). failed_precondition for a bracket on a camera whose exposure cannot be set.
[[nodiscard]] Result<SelectedControls> choose_controls(const SupportedControls& offered, const LibcameraOptions& asked);

}  // namespace lightwell::libcam
