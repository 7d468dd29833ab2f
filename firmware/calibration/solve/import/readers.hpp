// One reader per format; import.cpp makes a rig from their common result.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

struct ImportedCamera {
  std::string name;
  int width = 0, height = 0;
  ModelParameters model;
  /// Whether the program that calibrated it can use observations beyond 90 degrees; otherwise the model extrapolates.
  bool valid_beyond_90_deg = true;
};

struct ImportedCameras {
  std::vector<ImportedCamera> cameras;  ///< One, or two.
  Pose second_from_first;               ///< T_c1_c0 of two cameras, axes _cv.
  std::vector<std::string> notes;
};

/// `camera`: index of the only camera to read; empty: all.
[[nodiscard]] Result<ImportedCameras> read_kalibr_camchain(std::string_view text, const std::string& name,
                                                           std::optional<int> camera);
[[nodiscard]] Result<ImportedCameras> read_ros_camera_info(std::string_view text, const std::string& name);
[[nodiscard]] Result<ImportedCameras> read_opencv_storage(std::string_view text, const std::string& name);

/// The formats that a YAML document resembles.
struct YamlFormats {
  bool kalibr = false, ros = false;
};
[[nodiscard]] Result<YamlFormats> resembled_formats(std::string_view text, const std::string& name);

}  // namespace lightwell
