// What is known of the light before a picture is seen: weak priors, which decide where the observations do not.
#pragma once

#include <span>

#include <Eigen/Core>

#include "estimate/marker/fit_parameters.hpp"
#include "estimate/marker/observations.hpp"

namespace lightwell::marker {

/// Residuals with a standard deviation of 1, and their derivatives. They are, in this order:
/// - per channel: the ambient light's linear coefficients by its constant, and the constant by the faces' mean
///   irradiance;
/// - per light: its inverse distance;
/// - with the ground plane, for the ambient light and for each light: the share of it that the plane reflects, beside
///   the share of all light. The plane has one albedo. So a light that hardly illuminates the faces that are seen has
///   the irradiance that its shadow shows.
class LightPriors {
 public:
  LightPriors(const Observations& observations, const FitLayout& layout, std::span<const LightPose> start)
      : observations_(observations), layout_(layout), start_(start) {}

  [[nodiscard]] int rows() const;
  /// `parameters`: of the layout, rotations from `start`. `residuals`: rows() elements. `jacobian`: rows() rows, all
  /// zero, which are filled; or nullptr.
  void evaluate(const double* parameters, Eigen::Ref<Eigen::VectorXd> residuals, Eigen::Ref<RowMajor>* jacobian) const;

 private:
  struct PlaneLight;
  [[nodiscard]] PlaneLight plane_light(const double* parameters) const;
  void evaluate_albedo(const double* parameters, Eigen::Index row, Eigen::Ref<Eigen::VectorXd> residuals,
                       Eigen::Ref<RowMajor>* jacobian) const;

  const Observations& observations_;
  const FitLayout& layout_;
  std::span<const LightPose> start_;
};

}  // namespace lightwell::marker
