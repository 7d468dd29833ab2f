// Everything that a camera would change by itself is switched off, and what is in force is read back.
//   disable_auto_controls(), ExposureControl, configure_exposure()
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera/backends/v4l2/device.hpp"
#include "camera/backends/v4l2/options.hpp"

namespace lightwell::v4l2 {

/// V4L2_CID_EXPOSURE_ABSOLUTE counts in these.
inline constexpr double kExposureUnit_s = 1e-4;

/// Gain, white balance, power-line filter, focus and whatever else is automatic. `notes` gets what is in force now, as
/// read back, and what the device lacks.
void disable_auto_controls(Device& device, const Options& options, std::vector<std::string>& notes);

/// The cycle of exposures.
struct ExposureControl {
  std::optional<Control> control;  ///< None: exposure is not known, and `seconds` guessed.
  std::vector<int> codes;          ///< What to set for each place of the cycle; empty without a control.
  std::vector<double> seconds;     ///< What the device said when it was set.
};

/// Manual exposure, set to each of options.exposure_s and read back, at last to the first one. `rate` is the device's,
/// 0 where it does not say. invalid_argument for a bracket on a device that has no such control.
[[nodiscard]] Result<ExposureControl> configure_exposure(Device& device, const Options& options, double rate,
                                                      std::vector<std::string>& notes);

}  // namespace lightwell::v4l2
