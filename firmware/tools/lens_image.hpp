// Still images that the lenses of a calibrated rig took.
#pragma once

#include <string>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"
#include "imaging/image_file.hpp"

namespace lightwell {

/// read_image(). invalid_argument, with path and remedy: a lens that is not in the rig, a size that is not its own.
[[nodiscard]] Result<Image> read_lens_image(const std::string& path, const RigParameters& rig, int lens);

/// Refers to the pixels of `image`.
[[nodiscard]] View view_of(const Image& image, int lens);

}  // namespace lightwell
