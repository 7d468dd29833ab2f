// Folders of pictures, read for the photometric solvers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/photometry/picture.hpp"

namespace lightwell::calibrate {

/// What all pictures of a run have in common.
struct PictureKind {
  int lens = 0;
  int width = 0, height = 0;  ///< As the calibration of the lens says.
  int float_levels = 0;       ///< Codes behind OpenEXR's numbers, 0: none.
};

struct ListedPicture {
  std::string path, file;  ///< `file` as the list names it.
  double exposure_s = 1, gain = 1;
};

/// FOLDER/frames.csv (camera/backends/replay/frame_list.hpp): of each frame the picture of the lens, or its only one.
[[nodiscard]] Result<std::vector<ListedPicture>> list_pictures(const std::string& folder, const PictureKind& kind);

/// PNG, JPEG, OpenEXR or HDR; floats count as shares of full scale. invalid_argument for a size that is not the lens's.
[[nodiscard]] Result<photometry::Picture> read_picture(const std::string& path, const PictureKind& kind);

/// FOLDER/angles.csv, "file,angle_deg" under a line with these names: angles in rad by file. Empty where there is no
/// such file.
[[nodiscard]] Result<std::map<std::string, double>> read_angles(const std::string& folder);

}  // namespace lightwell::calibrate
