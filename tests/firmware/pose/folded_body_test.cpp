// find_body_pose with bodies whose faces are not where the body's file says.
#include <iostream>

#include <gtest/gtest.h>

#include "firmware/pose/bodies_in_view.hpp"
#include "firmware/pose/normalized_error.hpp"

namespace lightwell {
namespace {

using test::body_at;
using test::kDegree;

struct FoldedBodies {
  int count = 0, beyond = 0, ambiguous = 0;
};

/// Poses of bodies whose faces are off; `beyond` counts errors with e' C⁻¹ e above the quantile that 0.27 % of Gaussian
/// errors exceed (six degrees of freedom).
FoldedBodies folded_bodies(const test::BuildErrors& errors, const BodyPoseOptions& options, std::size_t min_tags) {
  constexpr double kThreeSigma6 = 20.06;
  const RigParameters rig = test::camera_rig();
  const MarkerBody body = test::dodecahedron();
  FoldedBodies out;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const Pose truth = body_at({0.03, 0.01, -test::distance_for(250)}, 4000 + seed);
    const auto seen =
        test::simulate_body_observations(rig, test::with_build_errors(body, errors, seed), truth, 0.05, seed);
    if (seen.size() < min_tags) continue;
    const auto pose = find_body_pose(rig, body, seen, std::nullopt, options);
    if (!pose) continue;
    ++out.count;
    out.ambiguous += pose->ambiguous;
    out.beyond +=
        6 * test::normalized_error(test::error_of(pose->probe_body.pose, truth), pose->probe_body.covariance) >
        kThreeSigma6;
  }
  std::cout << "faces off by " << errors.turn_rad / kDegree << " deg and " << 1000 * errors.shift_m << " mm, assumed "
            << options.face_turn_sigma_rad / kDegree << " deg and " << 1000 * options.face_shift_sigma_m
            << " mm: " << out.beyond << " of " << out.count << " beyond 3 sigma, ambiguous " << out.ambiguous << "\n";
  return out;
}

TEST(BodyPose, ErrorsOfTheFacesArePartOfTheCovariance) {
  const test::BuildErrors assumed{0.5 * kDegree, 0.25e-3}, doubled{1 * kDegree, 0.5e-3};
  BodyPoseOptions exact;
  exact.face_turn_sigma_rad = exact.face_shift_sigma_m = 0;
  const FoldedBodies usual = folded_bodies(assumed, {}, 1), rough = folded_bodies(doubled, {}, 3),
                     neglected = folded_bodies(assumed, exact, 1);
  EXPECT_GT(usual.count, 250);
  // 0.27 % are expected if the errors are as assumed. Chi² tells a doubled error only approximately: three tags have
  // 18 residuals that depend on 18 errors of the faces, of which the pose takes six.
  EXPECT_LE(usual.beyond, 0.02 * usual.count);
  EXPECT_LE(rough.beyond, 0.1 * rough.count);
  EXPECT_GE(neglected.beyond, 0.2 * neglected.count);
  EXPECT_LE(usual.ambiguous, neglected.ambiguous + 0.02 * usual.count);
}

}  // namespace
}  // namespace lightwell
