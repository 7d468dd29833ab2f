// The commands of a probe that its links call.
#pragma once

#include <lightwell/estimator_config.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

namespace lightwell {

/// Commands that links receive from clients. Called from any of a link's threads.
class Commands {
 public:
  virtual ~Commands() = default;

  [[nodiscard]] virtual StatusSnapshot status() const = 0;
  [[nodiscard]] virtual EstimatorConfig estimator() const = 0;
  /// The active estimator, which determines the available options.
  [[nodiscard]] virtual EstimatorKind estimator_kind() const = 0;
  /// Changes the fields of `update` atomically: concurrent updates do not overwrite each other's fields. Takes effect
  /// with the next capture. invalid_argument changes nothing.
  [[nodiscard]] virtual Status update_estimator(const EstimatorUpdate& update) = 0;
  /// Scales radiance so that the irradiance at `normal` (unit, probe frame) is `lux`; returns the factor.
  [[nodiscard]] virtual Result<double> report_lux(double lux, Vec3d normal) = 0;
};

}  // namespace lightwell
