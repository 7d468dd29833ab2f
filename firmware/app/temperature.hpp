// Temperature of the machine that the probe runs on.
#pragma once

#include <optional>
#include <string>

namespace lightwell {

/// Temperature of the hottest thermal zone, degrees Celsius; no value without a sensor. `folder`: that of the kernel's
/// thermal zones (Documentation/driver-api/thermal/sysfs-api). A sensor may take milliseconds.
[[nodiscard]] std::optional<float> read_temperature(const std::string& folder = "/sys/class/thermal");

}  // namespace lightwell
