// Imports calibrations of other programs. README.md describes the formats and their sources.
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
/// Inverse of to_string(). invalid_argument: an unknown name; the message lists the known ones.
[[nodiscard]] Result<ImportKind> parse_import_kind(std::string_view name);

struct ImportOptions {
  std::optional<ImportKind> kind;  ///< Empty: derived from the content.
  std::optional<int> camera;       ///< Index of the one camera of a camchain to import. Empty: all; one, or a pair.
  /// Half the field of view of every lens, rad; limited to the model's domain. Empty: the largest angle that projects
  /// into the largest circle about the principal point that fits into the picture.
  std::optional<double> max_angle_rad;

  [[nodiscard]] Status validate() const;
};

struct ImportedCalibration {
  RigParameters rig;  ///< Validated. Photometry: a linear sensor, because none of the formats contains any.
  ImportKind kind = ImportKind::opencv;
  std::vector<std::string> cameras;  ///< Name of each lens in the file, "cam0".
  std::vector<std::string> notes;    ///< Assumptions made, and further contents of the file.
};

/// Errors begin with `name` and state line or field, and the remedy. A single camera looks along the probe's -Z,
/// upright. For two, the origin is midway between them and -Z is the axis of the first.
[[nodiscard]] Result<ImportedCalibration> import_calibration(std::string_view text, const std::string& name,
                                                             const ImportOptions& options = {});
[[nodiscard]] Result<ImportedCalibration> import_calibration_file(const std::string& path,
                                                                  const ImportOptions& options = {});

/// As calibration.proto calls the models, "mei".
[[nodiscard]] std::string_view model_name(const ModelParameters& model);

}  // namespace lightwell
