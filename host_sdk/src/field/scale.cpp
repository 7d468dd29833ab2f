#include "field/scale.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace lightwell::field {
namespace {

constexpr double kRelativePrior = 5, kReferencePrior = 1e-3;
// Lamps are not isotropic: standard deviation of the logarithm of one intensity.
constexpr double kIntensitySigma = 0.3;

}  // namespace

std::vector<ScaleEstimate> estimate_scales(std::span<const ProbeView> views, std::span<const Observation> observations,
                                           std::span<const Placed> lights, double absolute_sigma) {
  // The factors, one of each calibration, by its first view.
  std::vector<std::size_t> factor(views.size());
  std::vector<std::size_t> first;
  for (std::size_t v = 0; v < views.size(); ++v) {
    factor[v] = first.size();
    for (std::size_t k = 0; k < first.size(); ++k)
      if (views[first[k]].absolute == views[v].absolute && views[first[k]].calibration == views[v].calibration)
        factor[v] = k;
    if (factor[v] == first.size()) first.push_back(v);
  }
  std::vector<std::size_t> matched(first.size());
  for (const Placed& light : lights)
    for (const std::size_t m : light.members) ++matched[factor[observations[m].view]];
  const bool any_absolute = std::ranges::any_of(views, &ProbeView::absolute);
  const std::size_t reference =
      static_cast<std::size_t>(std::ranges::max_element(matched) - matched.begin());  // Unless one is absolute.

  const auto factors = static_cast<Eigen::Index>(first.size());
  const Eigen::Index unknowns = factors + static_cast<Eigen::Index>(lights.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  for (std::size_t k = 0; k < first.size(); ++k) {
    const double prior = !any_absolute && k == reference ? kReferencePrior
                         : views[first[k]].absolute      ? absolute_sigma
                                                         : kRelativePrior;
    information(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) += 1 / (prior * prior);
  }
  constexpr double w = 1 / (kIntensitySigma * kIntensitySigma);
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const Eigen::Index column = factors + static_cast<Eigen::Index>(l);
    information(column, column) += 1e-9;
    for (const std::size_t m : lights[l].members) {
      const Observation& o = observations[m];
      const auto row = static_cast<Eigen::Index>(factor[o.view]);
      const double distance = lights[l].distant ? 1 : length(lights[l].position - o.origin);
      // scale + y = intensity, where the luminance is that before scaling.
      const double y = std::log(o.luminance / views[o.view].scale) + 2 * std::log(distance);
      information(row, row) += w;
      information(column, column) += w;
      information(row, column) -= w;
      information(column, row) -= w;
      right(row) -= w * y;
      right(column) += w * y;
    }
  }
  const Eigen::MatrixXd covariance = information.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  const Eigen::VectorXd solved = covariance * right;
  std::vector<ScaleEstimate> out;
  for (const std::size_t k : factor) {
    const auto i = static_cast<Eigen::Index>(k);
    out.push_back({solved(i), std::sqrt(std::max(covariance(i, i), 0.0))});
  }
  return out;
}

}  // namespace lightwell::field
