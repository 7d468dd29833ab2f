// A reader per format; each ends in the same values, which import.cpp makes a rig of.
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
  /// Whether the format's own calibration can have seen directions beyond 90 degrees.
  bool valid_beyond_90_deg = true;
};

struct ImportedCameras {
  std::vector<ImportedCamera> cameras;  ///< One, or two.
  Pose second_from_first;               ///< T_c1_c0 of two, axes in the sense of _cv.
  std::vector<std::string> notes;
};

/// `camera`: only that one of the chain.
[[nodiscard]] Result<ImportedCameras> read_kalibr_camchain(std::string_view text, const std::string& name,
                                                           std::optional<int> camera);
[[nodiscard]] Result<ImportedCameras> read_ros_camera_info(std::string_view text, const std::string& name);
[[nodiscard]] Result<ImportedCameras> read_opencv_storage(std::string_view text, const std::string& name);

/// Which of these a YAML document looks like.
struct YamlKinds {
  bool kalibr = false, ros = false;
};
[[nodiscard]] Result<YamlKinds> yaml_kinds(std::string_view text, const std::string& name);

}  // namespace lightwell
