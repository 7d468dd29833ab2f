// Measures a camera before streaming: the exposures it sets when asked for those of the cycle, whether it reports them,
// and its frame rate.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/lens.hpp"
#include "camera/backends/libcamera/mailbox.hpp"

namespace lightwell::libcam {

struct CameraCapabilities {
  bool reports_exposure = false;   ///< Each frame's metadata states its exposure.
  std::vector<double> exposure_s;  ///< The cycle: as reported, or as requested if the camera does not report it.
  double gain = 1;
  Duration interval;  ///< Frame interval.
  std::vector<std::string> notes;
};

/// Starts `lens`, takes frames, and stops it: a second or two at 30 frames per second. unavailable if no frame comes
/// within 5 s; failed_precondition if a bracket's reported exposures are not the requested ones (a single exposure: a
/// note), or if a report is not positive.
[[nodiscard]] Result<CameraCapabilities> probe_capabilities(Lens& lens, Mailbox& mailbox, Mailbox::Events& post,
                                                            double nominal_rate);

/// Frame interval from the time between the first and the last of `frames` intervals; `nominal` if that is implausible.
[[nodiscard]] Duration measured_interval(Duration passed, std::uint64_t frames, Duration nominal);

}  // namespace lightwell::libcam
