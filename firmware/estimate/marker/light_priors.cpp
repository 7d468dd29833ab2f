#include "estimate/marker/light_priors.hpp"

#include <algorithm>
#include <array>

namespace lightwell::marker {
namespace {

/// Rows of the ambient light of one channel.
constexpr int kAmbientRows = 4;
/// The prior of the ambient light's linear coefficients is relative to at least this share of the mean irradiance.
constexpr double kMinAmbientFraction = 0.02;
/// Standard deviation of the constant ambient irradiance, relative to the mean irradiance. Three faces do not determine
/// the four coefficients.
constexpr double kAmbientSigma = 1;
/// Standard deviation of an inverse distance, 1/m: 0.67 m. Sheen and a glossy table look like near lights.
constexpr double kInverseDistanceSigma = 1.5;
/// Standard deviation of the difference of two reflected shares by their sum (gloss, texture, light that clutter
/// hides): 0.12 is a ratio of 1.27. Lights below kMinLightShare of all irradiance are hardly limited.
constexpr double kAlbedoSigma = 0.12, kMinLightShare = 0.02;

}  // namespace

/// Radiance x and irradiance y of the ground plane by the ambient light and by each light, and their derivatives.
struct LightPriors::PlaneLight {
  Eigen::VectorXd x, y;
  RowMajor dx, dy;

  PlaneLight(Eigen::Index count, Eigen::Index parameters)
      : x(Eigen::VectorXd::Zero(count)), y(x), dx(RowMajor::Zero(count, parameters)), dy(dx) {}
};

int LightPriors::rows() const {
  const auto lights = static_cast<int>(layout_.lights.size());
  return kAmbientRows * observations_.channels() + lights + (layout_.ground >= 0 ? 1 + lights : 0);
}

void LightPriors::evaluate(const double* parameters, Eigen::Ref<Eigen::VectorXd> residuals,
                           Eigen::Ref<RowMajor>* jacobian) const {
  Eigen::Index row = 0;
  for (int c = 0; c < observations_.channels(); ++c, row += kAmbientRows) {
    const int first = layout_.ambient + 4 * c;
    const double* ambient = parameters + first;
    const double mean = observations_.mean_irradiance(c);
    const double flat = kAmbientGradientSigma * (std::max(0.0, ambient[0]) + kMinAmbientFraction * mean);
    for (int b = 0; b < 3; ++b) residuals[row + b] = ambient[1 + b] / flat;
    residuals[row + 3] = mean > 0 ? ambient[0] / (kAmbientSigma * mean) : 0;
    if (jacobian == nullptr) continue;
    for (int b = 0; b < 3; ++b) {
      (*jacobian)(row + b, first + 1 + b) = 1 / flat;
      (*jacobian)(row + b, first) = ambient[0] > 0 ? -ambient[1 + b] * kAmbientGradientSigma / (flat * flat) : 0;
    }
    (*jacobian)(row + 3, first) = mean > 0 ? 1 / (kAmbientSigma * mean) : 0;
  }
  for (const FitLayout::LightParameters& offsets : layout_.lights) {
    residuals[row] = offsets.inverse >= 0 ? parameters[offsets.inverse] / kInverseDistanceSigma : 0;
    if (jacobian != nullptr && offsets.inverse >= 0) (*jacobian)(row, offsets.inverse) = 1 / kInverseDistanceSigma;
    ++row;
  }
  if (layout_.ground >= 0) evaluate_albedo(parameters, row, residuals, jacobian);
}

LightPriors::PlaneLight LightPriors::plane_light(const double* parameters) const {
  const Vec3d& normal = observations_.ground()->normal;
  const double share = 1.0 / observations_.channels();
  PlaneLight out(static_cast<Eigen::Index>(1 + layout_.lights.size()), layout_.size);
  out.x[0] = parameters[layout_.ground], out.dx(0, layout_.ground) = 1;
  const std::array<double, 4> basis = {1, normal.x, normal.y, normal.z};
  for (int i = 0; i < 4 * observations_.channels(); ++i) {
    out.dy(0, layout_.ambient + i) = share * basis[static_cast<std::size_t>(i % 4)];
    out.y[0] += out.dy(0, layout_.ambient + i) * parameters[layout_.ambient + i];
  }
  if (out.y[0] < 0) out.y[0] = 0, out.dy.row(0).setZero();
  for (std::size_t k = 0; k < layout_.lights.size(); ++k) {
    const FitLayout::LightParameters& offsets = layout_.lights[k];
    const auto at = static_cast<Eigen::Index>(1 + k);
    const int own = layout_.ground + 1 + static_cast<int>(k);
    const auto [direction, to_u, to_v] =
        start_[k].turned_with_slopes(parameters[offsets.turn], parameters[offsets.turn + 1]);
    const double elevation = dot(direction, normal);
    if (elevation <= 0) continue;
    double irradiance = 0;
    for (int c = 0; c < observations_.channels(); ++c) {
      irradiance += share * parameters[offsets.irradiance + c];
      out.dy(at, offsets.irradiance + c) = share * elevation;
    }
    out.x[at] = parameters[own] * elevation, out.dx(at, own) = elevation;
    out.y[at] = irradiance * elevation;
    for (int axis = 0; axis < 2; ++axis) {
      const double slope = dot(axis == 0 ? to_u : to_v, normal);
      out.dx(at, offsets.turn + axis) = parameters[own] * slope;
      out.dy(at, offsets.turn + axis) = irradiance * slope;
    }
  }
  return out;
}

/// With X and Y the sums of x and y over all light, a residual is (x Y - y X) / (x Y + y X + kMinLightShare X Y), whose
/// magnitude is below 1, divided by kAlbedoSigma.
void LightPriors::evaluate_albedo(const double* parameters, Eigen::Index row, Eigen::Ref<Eigen::VectorXd> residuals,
                                  Eigen::Ref<RowMajor>* jacobian) const {
  const PlaneLight by = plane_light(parameters);
  const double x = by.x.sum(), y = by.y.sum();
  const Eigen::RowVectorXd dx = by.dx.colwise().sum(), dy = by.dy.colwise().sum();
  for (Eigen::Index k = 0; k < by.x.size(); ++k, ++row) {
    const double a = by.x[k] * y, b = by.y[k] * x, sum = a + b + kMinLightShare * x * y;
    residuals[row] = 0;
    if (!(sum > 0)) continue;
    const double difference = (a - b) / sum;
    residuals[row] = difference / kAlbedoSigma;
    if (jacobian == nullptr) continue;
    const Eigen::RowVectorXd da = by.dx.row(k) * y + by.x[k] * dy, db = by.dy.row(k) * x + by.y[k] * dx;
    jacobian->row(row) = (da - db - difference * (da + db + kMinLightShare * (dx * y + x * dy))) / (sum * kAlbedoSigma);
  }
}

}  // namespace lightwell::marker
