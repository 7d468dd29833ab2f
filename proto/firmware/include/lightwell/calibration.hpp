// Geometric and photometric calibration of a camera rig, and a probe's pose in its room, as values. Meanings:
// proto/lightwell/v1/calibration.proto.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <lightwell/calibration_summary.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// Kannala & Brandt 2006, with the parameter order of OpenCV's fisheye model.
struct KannalaBrandtParameters {
  double fx = 0, fy = 0, cx = 0, cy = 0, k1 = 0, k2 = 0, k3 = 0, k4 = 0;
};
/// Usenko et al. 2018, eq. 40 to 46.
struct DoubleSphereParameters {
  double fx = 0, fy = 0, cx = 0, cy = 0, xi = 0, alpha = 0;
};
/// Mei & Rives 2007 with OpenCV's omnidir distortion; no skew.
struct MeiParameters {
  double fx = 0, fy = 0, cx = 0, cy = 0, xi = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0;
};
/// The whole sphere, no parameters.
struct EquirectangularParameters {};

using ModelParameters =
    std::variant<KannalaBrandtParameters, DoubleSphereParameters, MeiParameters, EquirectangularParameters>;

/// Camera response: maps a picture value to linear exposure, both 0 to 1.
struct ResponseCurve {
  enum class Kind { linear, srgb, table, gamma };
  Kind kind = Kind::linear;
  std::vector<double> inverse;  ///< For table: linear values at evenly spaced picture values, increasing.
  double gamma = 1;             ///< For gamma: linear = value^gamma.
};

struct PhotometricCalibration {
  ResponseCurve response;
  double black_level = 0;              ///< Linear value without light, fraction of full scale.
  std::array<double, 3> vignetting{};  ///< 1 + v1 theta² + v2 theta⁴ + v3 theta⁶.
  double read_noise = 0;               ///< Standard deviation, fraction of full scale, gain 1.
  double shot_noise = 0;               ///< Variance per linear value, fraction of full scale, gain 1.
  double saturation = 0.98;            ///< Picture values from here on are saturated: lower bounds.
  std::array<double, 3> white_balance{1, 1, 1};
};

struct LensParameters {
  int width = 0, height = 0;
  ModelParameters model;
  double max_angle_rad = 0;  ///< Half the field of view; pi for equirectangular.
  Pose pose_cv;              ///< T_probe_lens for lens axes in the _cv convention (x right, y down, z forward).
  PhotometricCalibration photometry;
};

struct RigParameters {
  std::vector<LensParameters> lenses;  ///< One or two.
  double nits_per_unit = 0;  ///< cd/m² per unit of linear value / (exposure_s gain vignetting). 0: relative units.
  std::optional<CalibrationReport> report{};  ///< If the file has one.

  /// invalid_argument, naming the lens and the field: no lens or more than two, an impossible size, focal length or
  /// field of view, a response that is not increasing.
  [[nodiscard]] Status validate() const;
};

/// Rotation from a lens's _cv axes to the probe's axes, for a lens that looks along -Z with its picture upright.
[[nodiscard]] constexpr Quat upright_lens_cv() { return {1, 0, 0, 0}; }

/// Reads a RigCalibration in protobuf text format and validates it.
[[nodiscard]] Result<RigParameters> load_calibration(const std::string& path);
[[nodiscard]] Result<RigParameters> parse_calibration(std::string_view text, const std::string& name);
[[nodiscard]] std::string calibration_to_text(const RigParameters& rig);
/// A RigCalibration in binary form, without its report: RecordingHeader::calibration. Equal values have equal bytes.
[[nodiscard]] std::string encode_calibration(const RigParameters& rig);
/// data_loss for bytes that are not a RigCalibration, otherwise the error of RigParameters::validate().
[[nodiscard]] Result<RigParameters> decode_calibration(std::string_view bytes);
/// Hash of the bytes of encode_calibration(): equal values have equal identities, whatever the layout of the file.
[[nodiscard]] std::uint32_t calibration_identity(const RigParameters& rig);

/// `file`: the name, without its folder; empty: the camera's own calibration.
[[nodiscard]] CalibrationSummary summary_of(const RigParameters& rig, std::string file);

/// Reads a Mounting in protobuf text format, T_world_probe with its covariance, and normalises its rotation.
/// invalid_argument, naming the field: a rotation that is zero or not finite, a translation that is not finite, a
/// variance that is negative or NaN, a covariance larger than its variances allow.
[[nodiscard]] Result<UncertainPose> load_mounting(const std::string& path);
[[nodiscard]] Result<UncertainPose> parse_mounting(std::string_view text, const std::string& name);
[[nodiscard]] std::string mounting_to_text(const UncertainPose& T_world_probe);

}  // namespace lightwell
