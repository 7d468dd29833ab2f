// What a probe tells of its calibration: not its numbers, but what is calibrated and how well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lightwell {

/// How a calibration was measured; lightwell-calibrate writes it. It is no part of the calibration's identity.
struct CalibrationReport {
  std::int64_t geometry_time_s = 0;  ///< When the lenses were fitted, seconds since 1970 (UTC); 0: not known.
  double rms_px = 0;                 ///< RMS of the residuals of both coordinates, px.
  std::uint32_t points = 0;          ///< Observations in the fit.
  std::vector<double> seen_deg;      ///< For each lens: the largest angle from the axis at which boards were seen.
  /// For each lens: largest uncertainty of a direction up to seen_deg, three standard deviations, degrees.
  std::vector<double> direction_3_sigma_deg;
  std::int64_t photometry_time_s = 0;  ///< When photometry was last measured; 0: not known.

  friend bool operator==(const CalibrationReport&, const CalibrationReport&) = default;
};

struct LensSummary {
  std::uint32_t width = 0, height = 0;  ///< Of the picture that the calibration is for, px.
  std::string model;                    ///< Field of the model in calibration.proto: "kannala_brandt".
  double max_angle_deg = 0;             ///< Half the field of view.
  std::string response;                 ///< "linear", "srgb", "table" or "gamma".
  bool vignetting = false;              ///< Vignetting is corrected.
  bool noise = false;                   ///< Read or shot noise is known.

  friend bool operator==(const LensSummary&, const LensSummary&) = default;
};

struct CalibrationSummary {
  std::uint32_t id = 0;   ///< Descriptor::calibration_id.
  std::string file;       ///< Name of the file, without its folder; empty: the camera's own calibration.
  bool absolute = false;  ///< cd/m² of a pixel value are known.
  std::vector<LensSummary> lenses;
  std::optional<CalibrationReport> report;

  friend bool operator==(const CalibrationSummary&, const CalibrationSummary&) = default;
};

}  // namespace lightwell
