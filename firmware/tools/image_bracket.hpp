// Frames from still images, as input of the estimator for lightwell-estimate.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"
#include "imaging/image_file.hpp"

namespace lightwell {

/// One image of the command line.
struct ImageArgument {
  std::string path;
  int lens = 0;
  double exposure_s = 0;  ///< 0: not given.
};

/// A bracket whose frames refer to the images that it owns.
struct ImageBracket {
  std::vector<std::unique_ptr<Image>> images;
  std::vector<Frame> frames;
  /// Number of values of float images that are negative, NaN or infinite, which the estimator replaces.
  std::size_t invalid_values = 0;
  RigParameters rig;  ///< The lenses that have images, renumbered from 0 in their order.
};

/// Reads the images and combines the exposures of all lenses to frames, shortest first. An image without exposure_s has
/// an exposure of one second. invalid_argument, with image and remedy: a lens that is not in the rig, a size that
/// differs from the calibration's, lenses with different exposures, a repeated exposure.
[[nodiscard]] Result<ImageBracket> read_bracket(const RigParameters& rig, const std::vector<ImageArgument>& arguments);

/// A rig of one equirectangular lens with this picture size and an sRGB response.
[[nodiscard]] RigParameters equirectangular_rig(int width, int height);

}  // namespace lightwell
