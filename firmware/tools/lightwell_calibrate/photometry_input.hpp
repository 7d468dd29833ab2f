// Reads folders of pictures for the photometric solvers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::calibrate {

/// Properties common to all pictures of a run.
struct PictureKind {
  int lens = 0;
  int width = 0, height = 0;  ///< Of the lens's calibration.
  int float_levels = 0;       ///< Number of quantisation levels of OpenEXR values; 0: not quantised.
};

struct ListedPicture {
  std::string path, file;  ///< `file`: the name in the list.
  double exposure_s = 1, gain = 1;
};

/// Reads FOLDER/frames.csv (camera/backends/replay/frame_list.hpp): of each frame the picture of the lens, or the only
/// one.
[[nodiscard]] Result<std::vector<ListedPicture>> list_pictures(const std::string& folder, const PictureKind& kind);

/// PNG, JPEG, OpenEXR or HDR; floats are relative to full scale. invalid_argument: the size differs from the lens's.
[[nodiscard]] Result<photometry::Picture> read_picture(const std::string& path, const PictureKind& kind);

/// Reads FOLDER/angles.csv with the header "file,angle_deg": angles in rad by file. Empty if there is no such file.
[[nodiscard]] Result<std::map<std::string, double>> read_angles(const std::string& folder);

}  // namespace lightwell::calibrate
