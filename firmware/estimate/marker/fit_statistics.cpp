// Residuals of a fit, and its likelihood.
#include <algorithm>
#include <cmath>

#include "estimate/marker/light_fit.hpp"

namespace lightwell::marker {
namespace {

/// Reduced chi square of matte faces on a plain table with exact lights. Below 1: the error model allows for more.
constexpr double kUsualChiSquare = 0.25;
/// Degrees of freedom of the distribution of the errors of the faces: how well their variance is known beforehand.
constexpr double kErrorDegreesOfFreedom = 4;
}  // namespace

double Fit::dispersion() const {
  return std::max(1.0, chi_square / (kUsualChiSquare * std::max(1, observations - parameters)));
}

double Fit::face_dispersion() const {
  return face_chi_square / (kUsualChiSquare * std::max(1, channels * face_samples - parameters));
}

double Fit::deviance() const {
  const double faces = (face_samples + kErrorDegreesOfFreedom) *
                       std::log1p(face_chi_square / channels / (kErrorDegreesOfFreedom * kUsualChiSquare));
  return faces + ground_deviance + (chi_square - face_chi_square - ground_chi_square);
}

double Fit::bic() const { return deviance() + parameters * std::log(std::max(face_samples + ground_samples, 2.0)); }

std::vector<double> standardized_residuals(const Observations& observations, const LightModel& model) {
  std::vector<double> out;
  for (int i = 0; i < observations.samples(); ++i) {
    const SurfaceSample& s = observations.face_samples()[static_cast<std::size_t>(i)];
    double most = 0;
    for (int c = 0; c < observations.channels(); ++c) {
      const auto channel = static_cast<std::size_t>(c);
      double sum = model.ambient[0][channel] + model.ambient[1][channel] * s.normal.x +
                   model.ambient[2][channel] * s.normal.y + model.ambient[3][channel] * s.normal.z;
      for (const PointLight& light : model.lights)
        sum += light.irradiance[channel] * relative_irradiance(light.direction, light.inverse_distance, s);
      const double d = observations.standardized_residual(c, i, s.irradiance[channel] - sum);
      if (std::abs(d) > std::abs(most)) most = d;
    }
    out.push_back(most);
  }
  return out;
}

Eigen::ArrayXd ground_residuals(const Observations& observations, const Fit& fit, const std::vector<Vec3d>& hull) {
  if (observations.ground() == nullptr) return {};
  const GroundObservations& ground = *observations.ground();
  Eigen::ArrayXd out = ground.radiance - fit.ground_ambient * ground.open, unit_irradiance;
  Shadow shadow;
  for (std::size_t k = 0; k < fit.model.lights.size() && k < fit.ground_irradiance.size(); ++k) {
    const PointLight& light = fit.model.lights[k];
    shadow.compute_irradiance(ground, hull, light.direction, light.inverse_distance, unit_irradiance);
    out -= fit.ground_irradiance[k] * unit_irradiance;
  }
  return out;
}

}  // namespace lightwell::marker
