// The tables of camera backends and of estimators in this build.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "camera/backend.hpp"
#include "estimate/estimator.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

struct BackendEntry {
  std::string_view scheme;
  std::string_view help;  ///< One line for `lightwelld --cameras`.
  Result<std::unique_ptr<CameraBackend>> (*make)(const CameraUri&, const CameraConfig&);
};

[[nodiscard]] std::span<const BackendEntry> backend_table();

/// Creates the backend for the scheme of config.uri. not_found: an unknown scheme; the message lists the known ones.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_backend(const CameraConfig& config);

struct EstimatorEntry {
  EstimatorKind kind;
  std::string_view source;  ///< What light is estimated from, for `lightwelld --help`.
  Result<std::unique_ptr<Estimator>> (*make)(const Config&, const RigParameters&, const std::optional<UncertainPose>&);
};

[[nodiscard]] std::span<const EstimatorEntry> estimator_table();

/// Creates the estimator of config.estimator_kind for a camera with this calibration. `mounting`: the pose of the probe
/// in the room, if known. failed_precondition: not in this build.
[[nodiscard]] Result<std::unique_ptr<Estimator>> make_estimator(const Config& config, const RigParameters& rig,
                                                                const std::optional<UncertainPose>& mounting);

}  // namespace lightwell
