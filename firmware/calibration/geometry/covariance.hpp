// What a fit knows, from the residuals that it left, without taking them for independent of each other or alike: those
// of one capture share its blur, its motion and its light, and a tag's corners share edges.
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace lightwell::calibration {

/// The rows of one capture: derivatives by the shared parameters after the capture's own were eliminated, and residuals
/// projected likewise; both weighted by the loss.
struct Cluster {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;
};

struct ClusteredCovariance {
  bool determined = false;     ///< Whether the rows determine every parameter.
  Eigen::VectorXd step;        ///< The Gauss-Newton step that is left: of what was held, how it would move.
  Eigen::MatrixXd covariance;  ///< Empty where not determined.
};

/// Eliminates columns that only this cluster has: what `own` spans is projected out.
[[nodiscard]] Cluster eliminate_nuisance(const Eigen::MatrixXd& own, const Eigen::MatrixXd& shared,
                                 const Eigen::VectorXd& residuals);

/// Sandwich covariance, clustered (Liang & Zeger 1986) and corrected for the leverage of each cluster (CR2, Bell &
/// McCaffrey 2002): exact in the mean for noise that is alike everywhere, valid for noise that differs from capture to
/// capture or is correlated within one. As a few captures do not tell a whole matrix, the scores' covariance is shrunk
/// towards that of noise that is alike everywhere (Ledoit & Wolf 2004). `prior`: one row a parameter, its diagonal in
/// the residuals' unit; 0 for none.
[[nodiscard]] ClusteredCovariance clustered_covariance(const std::vector<Cluster>& clusters,
                                                       const Eigen::VectorXd& prior);

}  // namespace lightwell::calibration
