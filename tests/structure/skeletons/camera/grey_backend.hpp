// A camera that delivers grey frames: step 1 of "A camera backend" in CONTRIBUTING.md.
#pragma once

#include <memory>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// `grey:` has no parameters. Frames have the size and rate of `config`.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_grey_backend(const CameraUri& uri,
                                                                       const CameraConfig& config);

}  // namespace lightwell
