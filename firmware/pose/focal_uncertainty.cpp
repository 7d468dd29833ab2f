#include "pose/focal_uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace lightwell {

namespace {

/// Beyond, the second order of the corners' noise is larger than what is seen of the focal length.
constexpr double kMaxFocalSigma = 0.05;

}  // namespace

/// Linear least squares in the six numbers x and the focal length's excess e: residuals are r + J x + e g. The pose
/// that was solved for took e for zero, which moves it by (J'J)⁻¹ J'g for e of one; what J cannot take up of g shows e.
FocalUncertainty estimate_focal_uncertainty(const PosedLenses& rig, std::span<const TagObservation> seen, const Quads& quads,
                       const CornerSolution& solution) {
  FocalUncertainty out;
  out.check.sigma = std::numeric_limits<double>::infinity();
  Eigen::VectorXd g = Eigen::VectorXd::Zero(solution.residual.size());
  Eigen::Index row = 0;
  for (const ObservedTag* quad : quads) {
    const TagObservation& tag = seen[quad->index];
    const PosedLens& lens = rig.at(tag.lens);
    const auto& axis = lens.axis;
    for (std::size_t i = 0; i < quad->corners.size(); ++i, row += 2) {
      const CornerObservation& corner = quad->corners[i];
      const PixelPosition p = tag.tag.corners[i];
      // Inwards, where the lens certainly sees. With a shorter focal length the pixel is further from the axis.
      constexpr double kStep = 1e-3;
      const auto moved =
          axis ? lens.model.unproject({p.x - kStep * (p.x - axis->x), p.y - kStep * (p.y - axis->y)}) : std::nullopt;
      if (!moved) continue;
      const Vec3d change = (rotate(lens.probe_lens.rotation, *moved) - corner.direction) * (-1 / kStep);
      g.segment<2>(row) = -(corner.weigh * Eigen::Vector2d(dot(change, corner.u), dot(change, corner.v)));
    }
  }
  // In units in which the normal equations have ones in the diagonal: radians and metres are not of a size.
  const Vector6d unit = solution.slope.colwise().norm().cwiseInverse();
  const Eigen::Matrix<double, Eigen::Dynamic, 6> slope = solution.slope * unit.asDiagonal();
  const Eigen::LDLT<Matrix6d> normal(slope.transpose() * slope);
  if (!unit.allFinite() || normal.info() != Eigen::Success) return out;
  const Vector6d pulled = normal.solve(slope.transpose() * g);
  if (!pulled.allFinite()) return out;
  out.focal_jacobian = unit.asDiagonal() * pulled;
  // What the pose cannot take up of g, and of the residuals, of which the robust loss left some.
  const Eigen::VectorXd across = g - slope * pulled;
  const Eigen::VectorXd rest = solution.residual - slope * normal.solve(slope.transpose() * solution.residual);
  const double shown = across.squaredNorm();
  // Rounding of what cancels.
  if (!(shown > 1e-9 * g.squaredNorm())) return out;
  const double excess = -across.dot(rest) / shown;
  const double freedom = static_cast<double>(rest.size()) - 7;
  const double left = (rest + excess * across).squaredNorm();
  const double sigma = std::sqrt(std::max(1.0, freedom > 0 ? left / freedom : 1.0) / shown);
  if (sigma < kMaxFocalSigma) out.check = {excess, sigma};
  return out;
}

}  // namespace lightwell
