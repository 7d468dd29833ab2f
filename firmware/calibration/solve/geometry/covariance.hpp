// Covariance of estimated parameters from the residuals, without assuming that these are independent or identically
// distributed: the residuals of one capture share its blur, motion and light, and the corners of a tag share edges.
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace lightwell::calibration {

/// The residuals of one capture: Jacobian with respect to the shared parameters and residuals, both projected onto the
/// complement of the capture's own parameters and weighted by the loss.
struct Cluster {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;
};

struct ClusteredCovariance {
  bool determined = false;     ///< Whether the residuals determine all parameters.
  Eigen::VectorXd step;        ///< Remaining Gauss-Newton step; for parameters that were held, their estimated change.
  Eigen::MatrixXd covariance;  ///< Empty if not determined.
};

/// Eliminates the nuisance parameters of one cluster: projects onto the orthogonal complement of the columns of `own`.
[[nodiscard]] Cluster eliminate_nuisance(const Eigen::MatrixXd& own, const Eigen::MatrixXd& shared,
                                         const Eigen::VectorXd& residuals);

/// Cluster-robust sandwich covariance (Liang & Zeger 1986) with a leverage correction (CR2, Bell & McCaffrey 2002):
/// unbiased for homoscedastic noise, and valid for noise that differs between captures or is correlated within one.
/// Because a few captures do not determine a full matrix, the covariance of the scores is shrunk towards that of
/// homoscedastic noise (Ledoit & Wolf 2004). `prior`: one row per parameter, given by its diagonal entry in the
/// residuals' unit; 0: no prior.
[[nodiscard]] ClusteredCovariance clustered_covariance(const std::vector<Cluster>& clusters,
                                                       const Eigen::VectorXd& prior);

}  // namespace lightwell::calibration
