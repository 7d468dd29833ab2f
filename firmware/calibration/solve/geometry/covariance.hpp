// Covariance of estimated parameters from residuals that are neither independent nor identically distributed: those of
// one capture share its blur, motion and light, and the corners of a tag share edges.
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

/// Sandwich covariance clustered by capture, with the corrections that README.md names: unbiased for homoscedastic
/// noise; shrunk because a few captures do not determine a full matrix. `prior`: one row per parameter, given by its
/// diagonal entry in the residuals' unit; 0: no prior.
[[nodiscard]] ClusteredCovariance clustered_covariance(const std::vector<Cluster>& clusters,
                                                       const Eigen::VectorXd& prior);

}  // namespace lightwell::calibration
