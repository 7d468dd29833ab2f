// Calibrations of other programs, read into ours. What each format means and where that is written: README.md here.
//   import_calibration        from text
//   import_calibration_file   from a file
//   model_name                "mei", as calibration.proto calls the models
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

enum class ImportKind {
  opencv,  ///< cv::FileStorage, YAML or XML: cv::fisheye (4 coefficients) and cv::omnidir (xi).
  kalibr,  ///< Kalibr's camchain YAML.
  ros,     ///< sensor_msgs/CameraInfo as YAML.
};

[[nodiscard]] std::string_view to_string(ImportKind kind);
/// By the name that to_string() gives; nothing for another.
[[nodiscard]] std::optional<ImportKind> import_kind(std::string_view name);

struct ImportOptions {
  std::optional<ImportKind> kind;  ///< Absent: told by the content.
  std::optional<int> camera;       ///< Which of a camchain's cameras, a rig of it alone. Absent: one, or a pair.
  /// Half the field of view of every lens; lowered to where the model ends. Absent: the largest angle that lands in the
  /// largest circle round the principal point that fits into the picture.
  std::optional<double> max_angle_rad;

  [[nodiscard]] Status validate() const;
};

struct ImportedCalibration {
  RigParameters rig;  ///< Validated. Photometry is that of a linear sensor: no format here knows better.
  ImportKind kind = ImportKind::opencv;
  std::vector<std::string> cameras;  ///< What the file calls each lens, "cam0".
  std::vector<std::string> notes;    ///< What a reader should know: what was assumed, what the file says besides.
};

/// `name` stands before messages, which name the line or the field and the remedy. A single camera looks along the
/// probe's -Z, upright. Of two, the origin is midway and -Z is the first one's axis.
[[nodiscard]] Result<ImportedCalibration> import_calibration(std::string_view text, const std::string& name,
                                                             const ImportOptions& options = {});
[[nodiscard]] Result<ImportedCalibration> import_calibration_file(const std::string& path,
                                                                  const ImportOptions& options = {});

[[nodiscard]] std::string_view model_name(const ModelParameters& model);

}  // namespace lightwell
