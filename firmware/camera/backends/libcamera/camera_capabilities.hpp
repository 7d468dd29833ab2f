// A few frames before the first that counts: what the camera makes of the exposures it is asked for, whether it says
// so, and how fast it is.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/lens.hpp"
#include "camera/backends/libcamera/mailbox.hpp"

namespace lightwell::libcam {

struct CameraCapabilities {
  bool reports_exposure = false;      ///< Each frame's metadata has the exposure in force.
  std::vector<double> exposure_s;  ///< As they are in force, or as asked for where the camera does not say.
  double gain = 1;
  Duration interval;  ///< Between frames.
  std::vector<std::string> notes;
};

/// Starts and stops `lens`, up to a second or two at 30 frames a second. unavailable where no frame comes in 5 s;
/// failed_precondition where the camera says exposures that are none of those asked for.
[[nodiscard]] Result<CameraCapabilities> probe_capabilities(Lens& lens, Mailbox& mailbox, Mailbox::Events& post, double nominal_rate);

/// Interval between frames from the times and numbers of the first and the last; `nominal` where they do not tell.
[[nodiscard]] Duration measured_interval(Duration passed, std::uint64_t frames, Duration nominal);

}  // namespace lightwell::libcam
