// Frames from still images: what lightwell-estimate hands to the estimator in place of a camera.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"
#include "camera/image_file.hpp"

namespace lightwell {

/// One image as the command line gives it.
struct ImageArgument {
  std::string path;
  int lens = 0;
  double exposure_s = 0;  ///< 0: none was given.
};

/// A bracket whose frames look into images that it owns.
struct ImageBracket {
  std::vector<std::unique_ptr<Image>> images;
  std::vector<Frame> frames;
  std::size_t unusual =
      0;              ///< Numbers of float images that are negative, NaN or infinite: the estimator replaces them.
  RigParameters rig;  ///< Of the lenses that have images, renumbered from 0 in their order.
};

/// Reads the images and pairs the lenses' exposures, shortest first. Without exposure_s an image counts as taken with
/// one second, and every lens has one image. invalid_argument names the image and the remedy: a lens that is not in
/// the rig, a size that is not the calibration's, lenses with different exposures, one exposure twice.
[[nodiscard]] Result<ImageBracket> read_bracket(const RigParameters& rig, const std::vector<ImageArgument>& arguments);

/// A rig that is one equirectangular picture of this size.
[[nodiscard]] RigParameters equirectangular_rig(int width, int height);

}  // namespace lightwell
