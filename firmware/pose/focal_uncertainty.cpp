#include "pose/focal_uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace lightwell {

namespace {

/// Beyond this, second-order effects of the corner noise exceed the effect of the focal length.
constexpr double kMaxFocalSigma = 0.05;

}  // namespace

/// Linear least squares in the six pose parameters x and the relative focal length error e: residuals r + J x + e g.
/// The pose was solved with e = 0, which moves it by (J'J)⁻¹ J'g per unit of e. The component of g orthogonal to the
/// columns of J determines e.
FocalUncertainty estimate_focal_uncertainty(const PosedLenses& rig, std::span<const TagObservation> observations,
                                            const Quads& quads, const CornerSolution& solution) {
  FocalUncertainty out;
  out.check.sigma = std::numeric_limits<double>::infinity();
  Eigen::VectorXd g = Eigen::VectorXd::Zero(solution.residual.size());
  Eigen::Index row = 0;
  for (const ObservedTag* quad : quads) {
    const TagObservation& tag = observations[quad->index];
    const PosedLens& lens = rig.at(tag.lens);
    const auto& axis = lens.axis;
    for (std::size_t i = 0; i < quad->corners.size(); ++i, row += 2) {
      const CornerObservation& corner = quad->corners[i];
      const PixelPosition p = tag.tag.corners[i];
      // One-sided difference towards the principal point, which is inside the field of view. A shorter focal length
      // corresponds to a pixel further from it.
      constexpr double kStep = 1e-3;
      const auto moved =
          axis ? lens.model.unproject({p.x - kStep * (p.x - axis->x), p.y - kStep * (p.y - axis->y)}) : std::nullopt;
      if (!moved) continue;
      const Vec3d change = (rotate(lens.probe_lens.rotation, *moved) - corner.direction) * (-1 / kStep);
      g.segment<2>(row) = -(corner.whitening * Eigen::Vector2d(dot(change, corner.u), dot(change, corner.v)));
    }
  }
  // Columns scaled to unit norm, because radians and metres have different magnitudes.
  const Vector6d unit = solution.jacobian.colwise().norm().cwiseInverse();
  const Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian = solution.jacobian * unit.asDiagonal();
  const Eigen::LDLT<Matrix6d> normal(jacobian.transpose() * jacobian);
  if (!unit.allFinite() || normal.info() != Eigen::Success) return out;
  const Vector6d pose_change = normal.solve(jacobian.transpose() * g);
  if (!pose_change.allFinite()) return out;
  out.focal_jacobian = unit.asDiagonal() * pose_change;
  // The components of g and of the residuals orthogonal to the Jacobian's columns. With a robust loss, the residuals
  // at the solution are not orthogonal to them.
  const Eigen::VectorXd across = g - jacobian * pose_change;
  const Eigen::VectorXd rest = solution.residual - jacobian * normal.solve(jacobian.transpose() * solution.residual);
  const double information = across.squaredNorm();
  // Below this, `across` is rounding error.
  if (!(information > 1e-9 * g.squaredNorm())) return out;
  const double relative_error = -across.dot(rest) / information;
  const double freedom = static_cast<double>(rest.size()) - 7;
  const double squares = (rest + relative_error * across).squaredNorm();
  const double sigma = std::sqrt(std::max(1.0, freedom > 0 ? squares / freedom : 1.0) / information);
  if (sigma < kMaxFocalSigma) out.check = {relative_error, sigma};
  return out;
}

}  // namespace lightwell
