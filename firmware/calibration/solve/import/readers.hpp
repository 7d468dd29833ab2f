// What the readers of the formats share (defined in import.cpp, which makes a rig from their common result), and one
// reader per format. Functions of this folder other than those of import.hpp report errors by throwing ImportError.
#pragma once

#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/solve/import/import.hpp"

namespace lightwell {

/// The message begins with the name of the file. import_calibration() returns it as invalid_argument.
struct ImportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The fields of a file, or of a map in it.
class Fields {
 public:
  virtual ~Fields() = default;
  [[nodiscard]] virtual bool has(const std::string& key) const = 0;
  /// The spelling of a key that is present, or empty; refuses two.
  [[nodiscard]] std::string find(const std::vector<std::string>& spellings) const;
  /// The spelling that is present; refuses none, with `remedy`.
  [[nodiscard]] std::string require(const std::vector<std::string>& spellings, const std::string& remedy = "") const;
  /// Throws "FILE:LINE: cam0.KEY: WHAT", as far as the format knows line and map.
  [[noreturn]] virtual void refuse(const std::string& key, const std::string& what) const = 0;
};

/// Focal lengths and principal point, pixels; the centre of the top left pixel is (0, 0).
struct PinholeFields {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// Refuses an invalid picture size, numbers that are not finite, and an invalid pinhole.
void check_size(const Fields& fields, const std::string& key, double width, double height);
void check_numbers(const Fields& fields, const std::string& key, std::span<const double> values);
void check_pinhole(const Fields& fields, const std::string& key, const PinholeFields& p);
/// From a 3x3 camera matrix (row-major); refuses another shape, skew, and an invalid pinhole.
[[nodiscard]] PinholeFields pinhole_of(const Fields& fields, const std::string& key, std::span<const double> k);

/// From four coefficients k1 k2 k3 k4; the order is the same in all three formats.
[[nodiscard]] KannalaBrandtParameters kannala_brandt_of(const PinholeFields& p, std::span<const double> k);
/// The unified model (Geyer & Daniilidis 2000, Mei & Rives 2007) with OpenCV's distortion in its order k1 k2 p1 p2 k3
/// k4 ...; with xi = 0 it is a pinhole. Empty if no supported model is exactly equal.
[[nodiscard]] std::optional<ModelParameters> unified_lens(const PinholeFields& p, double xi, std::span<const double> d);
/// Error text for a lens model that has no exact equivalent here: the reason and the remedy.
[[nodiscard]] std::string no_exact_model(const std::string& model, const std::string& why);
/// "1, 2"
[[nodiscard]] std::string listed(std::span<const double> values);

struct FieldOfView {
  double model_rad = 0;  ///< Largest angle of the model's domain, at most pi.
  /// The largest angle that projects, at every azimuth, into the largest circle about the principal point that fits
  /// into the picture. Empty if the principal point is outside the picture.
  std::optional<double> circle_rad;
};
/// None of the formats contains the field of view. `lens.max_angle_rad` is ignored.
[[nodiscard]] FieldOfView field_of_view(const LensParameters& lens);

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
[[nodiscard]] ImportedCameras read_kalibr_camchain(std::string_view text, const std::string& name,
                                                   std::optional<int> camera);
[[nodiscard]] ImportedCameras read_ros_camera_info(std::string_view text, const std::string& name);
[[nodiscard]] ImportedCameras read_opencv_storage(std::string_view text, const std::string& name);

/// The one format that a YAML document resembles; empty if it resembles none or two.
[[nodiscard]] std::optional<ImportKind> resembled_kind(std::string_view text, const std::string& name);

}  // namespace lightwell
