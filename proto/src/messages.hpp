// Conversion of values to and from the generated messages that several links and files share.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration_summary.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "lightwell/v1/probe_service.pb.h"

namespace lightwell {

struct ReceivedUpdate {
  EstimatorUpdate update;
  std::vector<std::string> warnings;  ///< One for each deprecated field: its name and its replacement.
};
/// The fields that are present in the message, for an estimator of this kind. An unknown enum value becomes 0, which is
/// never valid.
[[nodiscard]] ReceivedUpdate update_of(v1::EstimatorConfig m, EstimatorKind kind);
/// Sets exactly the fields of `update` that have a value.
void fill_config(const EstimatorUpdate& update, v1::EstimatorConfig& m);
/// Sets every field that is not deprecated.
[[nodiscard]] v1::EstimatorConfig message_of(const EstimatorConfig& config);

/// All fields except the clock.
void fill_status(const StatusSnapshot& status, v1::InfoResponse& m);
[[nodiscard]] StatusSnapshot status_of(const v1::InfoResponse& m);

/// Truncates texts above 256 bytes.
void fill_recording(const RecordingStatus& recording, v1::RecordingStatus& m);
[[nodiscard]] RecordingStatus recording_from(const v1::RecordingStatus& m);

void fill_report(const CalibrationReport& report, v1::CalibrationReport& m);
[[nodiscard]] CalibrationReport report_from(const v1::CalibrationReport& m);
/// Truncates the file's name above 256 bytes.
void fill_calibration(const CalibrationSummary& calibration, v1::GetCalibrationResponse& m);
[[nodiscard]] CalibrationSummary calibration_from(const v1::GetCalibrationResponse& m);
/// "linear", "srgb", ...; "unknown" for a kind of a later version.
[[nodiscard]] std::string_view response_name(v1::Response::Kind kind);

/// Does not normalise the rotation.
[[nodiscard]] Pose pose_from(const v1::Pose& m);
void fill_pose(const Pose& pose, v1::Pose& m);
/// invalid_argument: the rotation is zero or not finite, or the translation is not finite.
[[nodiscard]] Status pose_problem(const Pose& pose);

/// T_world_probe with a unit rotation. invalid_argument, naming the field: pose_problem(), a number of covariances
/// other than 0 and 21, a variance that is negative or NaN, a covariance larger than its variances allow.
[[nodiscard]] Result<UncertainPose> mounting_from(const v1::Mounting& m);
[[nodiscard]] v1::Mounting mounting_to(const UncertainPose& T_world_probe);

}  // namespace lightwell
