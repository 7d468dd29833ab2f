#include "field/scale.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace lightwell::field {
namespace {

constexpr double kRelativePrior = 5, kReferencePrior = 1e-3;
// Standard deviations of the logarithm of one intensity: of any lamp, where the iteration starts, and of lamps that
// shine alike in all directions, whose consensus it looks for.
constexpr double kUnevenSigma = 0.3, kConsensusSigma = 0.03;
// The loss narrows from the former to the latter (graduated non-convexity, Blake & Zisserman 1987).
constexpr double kNarrowing = 0.85;
constexpr int kRounds = 40;

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
  Eigen::VectorXd solved = Eigen::VectorXd::Zero(unknowns);
  Eigen::MatrixXd covariance;
  for (int round = 0; round < kRounds; ++round) {
    const double width = std::max(kUnevenSigma * std::pow(kNarrowing, round), kConsensusSigma);
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    for (std::size_t k = 0; k < first.size(); ++k) {
      const double prior = !any_absolute && k == reference ? kReferencePrior
                           : views[first[k]].absolute      ? absolute_sigma
                                                           : kRelativePrior;
      information(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) += 1 / (prior * prior);
    }
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const Eigen::Index column = factors + static_cast<Eigen::Index>(l);
      information(column, column) += 1e-9;
      for (const std::size_t m : lights[l].members) {
        const Observation& o = observations[m];
        const auto row = static_cast<Eigen::Index>(factor[o.view]);
        const double distance = lights[l].distant ? 1 : length(lights[l].position - o.origin);
        // scale + y = intensity, where the luminance is that before scaling.
        const double y = std::log(o.luminance / views[o.view].scale) + 2 * std::log(distance);
        const double residual = round == 0 ? 0 : solved(row) + y - solved(column);
        const double w = 1 / (width * width + residual * residual);
        information(row, row) += w;
        information(column, column) += w;
        information(row, column) -= w;
        information(column, row) -= w;
        right(row) -= w * y;
        right(column) += w * y;
      }
    }
    covariance = information.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
    solved = covariance * right;
  }
  std::vector<ScaleEstimate> out;
  for (const std::size_t k : factor) {
    const auto i = static_cast<Eigen::Index>(k);
    out.push_back({solved(i), std::sqrt(std::max(covariance(i, i), 0.0))});
  }
  return out;
}

}  // namespace lightwell::field
