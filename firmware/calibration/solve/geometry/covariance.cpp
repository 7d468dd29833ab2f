#include "calibration/solve/geometry/covariance.hpp"

#include <algorithm>

namespace lightwell::calibration {

/// Relative singular value of the matrix with normalised columns below which a parameter is not determined.
constexpr double kSingular = 1e-9;
/// Lower limit of 1 - leverage in the correction: a cluster that alone determines a direction leaves no residual there.
constexpr double kMinLeverageComplement = 0.05;

Cluster eliminate_nuisance(const Eigen::MatrixXd& own, const Eigen::MatrixXd& shared,
                           const Eigen::VectorXd& residuals) {
  const Eigen::VectorXd lengths = own.colwise().norm().cwiseMax(1e-300);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(own * lengths.cwiseInverse().asDiagonal());
  Eigen::MatrixXd all(shared.rows(), shared.cols() + 1);
  all << shared, residuals;
  all.applyOnTheLeft(qr.householderQ().transpose());
  const Eigen::Index left = all.rows() - qr.rank();
  return {all.bottomLeftCorner(left, shared.cols()), all.rightCols(1).bottomRows(left)};
}

ClusteredCovariance clustered_covariance(const std::vector<Cluster>& clusters, const Eigen::VectorXd& prior) {
  ClusteredCovariance out;
  const Eigen::Index n = prior.size();
  Eigen::Index rows = n;
  for (const Cluster& c : clusters) rows += c.jacobian.rows();
  Eigen::MatrixXd a(rows, n);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(rows);
  Eigen::Index at = 0;
  for (const Cluster& c : clusters) {
    a.middleRows(at, c.jacobian.rows()) = c.jacobian;
    r.segment(at, c.jacobian.rows()) = c.residuals;
    at += c.jacobian.rows();
  }
  a.bottomRows(n) = prior.asDiagonal();
  const Eigen::VectorXd lengths = a.colwise().norm();
  if (rows < 2 * n || !(lengths.minCoeff() > 0) || !lengths.allFinite() || !r.allFinite()) return out;
  a = a * lengths.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd triangle =
      Eigen::HouseholderQR<Eigen::MatrixXd>(a).matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle, Eigen::ComputeFullV);
  const Eigen::VectorXd& values = svd.singularValues();
  if (!(values(n - 1) > kSingular * values(0))) return out;
  out.determined = true;
  // a * whitener has orthonormal columns: for homoscedastic noise the scores have the covariance sigma² I.
  const Eigen::MatrixXd whitener = svd.matrixV() * values.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd back = lengths.cwiseInverse().asDiagonal() * whitener;
  out.step = -back * (whitener.transpose() * (a.transpose() * r));

  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(n, n), seen = middle;
  // Residuals after the step: the part that a held parameter would explain is not noise.
  std::vector<Eigen::VectorXd> scores;
  at = 0;
  for (const Cluster& c : clusters) {
    const Eigen::MatrixXd b = a.middleRows(at, c.jacobian.rows()) * whitener;
    at += c.jacobian.rows();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> leverage(b.transpose() * b);
    seen += b.transpose() * b;
    const Eigen::VectorXd enlarge =
        (1 - leverage.eigenvalues().array()).cwiseMax(kMinLeverageComplement).sqrt().inverse().matrix();
    scores.push_back(leverage.eigenvectors() * enlarge.asDiagonal() * leverage.eigenvectors().transpose() *
                     (b.transpose() * (c.residuals + c.jacobian * out.step)));
    middle += scores.back() * scores.back().transpose();
  }
  // `seen` is the identity except for the contribution of the prior.
  const double mean = middle.trace() / seen.trace(), count = static_cast<double>(scores.size());
  const Eigen::MatrixXd alike = mean * seen;
  const double distance = (middle - alike).squaredNorm();
  double variance = 0;
  for (const Eigen::VectorXd& s : scores)
    variance += (count * s * s.transpose() - middle).squaredNorm() / (count * count);
  const double share = distance > 0 ? std::min(1.0, variance / distance) : 1;
  middle = share * alike + (1 - share) * middle;
  // The prior is an observation with its own noise.
  const Eigen::MatrixXd known = whitener.transpose() * lengths.cwiseInverse().cwiseProduct(prior).asDiagonal();
  middle += mean * known * known.transpose();
  out.covariance = back * middle * back.transpose();
  return out;
}

}  // namespace lightwell::calibration
