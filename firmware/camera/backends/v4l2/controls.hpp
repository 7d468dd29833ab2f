// Switches off all automatic controls, sets manual values, and reads back the values in force.
//   disable_auto_controls(), ExposureControl, configure_exposure()
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera/backends/v4l2/device.hpp"
#include "camera/backends/v4l2/options.hpp"

namespace lightwell::v4l2 {

/// Unit of V4L2_CID_EXPOSURE_ABSOLUTE, s.
inline constexpr double kExposureUnit_s = 1e-4;

/// Sets gain, white balance, power-line filter, focus and other automatic controls. Appends the values read back and
/// the missing controls to `notes`.
void disable_auto_controls(Device& device, const Options& options, std::vector<std::string>& notes);

/// The cycle of exposures.
struct ExposureControl {
  std::optional<Control> control;  ///< Empty: no exposure control; `seconds` is an assumption.
  std::vector<int> codes;          ///< Control value by index in the cycle; empty without a control.
  std::vector<double> seconds;     ///< Exposure by index in the cycle, as read back.
};

/// Sets manual exposure: each of options.capture.exposure_s is set and read back, finally the first one. `rate`: frame
/// rate, 1/s, 0 if unknown. invalid_argument for a bracket on a device without an exposure control.
[[nodiscard]] Result<ExposureControl> configure_exposure(Device& device, const Options& options, double rate,
                                                         std::vector<std::string>& notes);

}  // namespace lightwell::v4l2
