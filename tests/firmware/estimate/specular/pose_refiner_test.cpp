// Poses of a textured plane from its texture.
#include "estimate/specular/pose_refiner.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "plane_pictures.hpp"

namespace lightwell::specular {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

class PoseRefinerTest : public ::testing::Test {
 protected:
  PoseRefinerTest() {
    for (std::size_t k = 0; k < texels_.count(); ++k) {
      const Vec3d v = smooth_texture(texels_.center(k));
      texture_.push_back({static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0});
    }
  }

  /// A pose that is off by 0.5 degrees and 2 mm, with that as its stated deviation.
  static UncertainPose wrong(const Pose& pose, int seed) {
    UncertainPose out;
    const Vec3d axis = fibonacci_direction(seed % 7, 7), shift = fibonacci_direction(seed % 5, 5) * 0.002;
    out.pose = {(Quat::about(axis, 0.5 * kDegree) * pose.rotation).normalized(), pose.translation + shift};
    for (std::size_t n = 0; n < 3; ++n) {
      out.covariance[n][n] = std::pow(0.5 * kDegree, 2);
      out.covariance[n + 3][n + 3] = 4e-6;
    }
    return out;
  }

  RefinedPose refine(const PlanePicture& picture, const UncertainPose& prior, const TexelImage& predicted,
                     const std::optional<Pose>& other = std::nullopt) {
    EXPECT_TRUE(reader_.bind(picture.bracket()).ok());
    EXPECT_TRUE(warp_.load(reader_, 0, prior.pose, 24, 1));
    TexelImage image;
    return refiner_.refine(warp_, prior, other, predicted, image);
  }

  /// Largest distance between where two poses put the plane's corners, as seen across the line of sight, m.
  static double displacement(const Pose& a, const Pose& b) {
    double out = 0;
    for (const Vec3d p : {Vec3d{-0.1, -0.1, 0}, Vec3d{0.1, -0.1, 0}, Vec3d{0.1, 0.1, 0}, Vec3d{-0.1, 0.1, 0}}) {
      const Vec3d from = transformed(a, p), to = transformed(b, p);
      out = std::max(out, angle_between(from, to) * length(from));
    }
    return out;
  }

  const RigParameters rig_ = pinhole_rig();
  const PlaneTexels texels_{0.2, 128};
  estimate::RowReader reader_{rig_};
  PlaneWarp warp_{rig_, texels_};
  PoseRefiner refiner_{texels_, {}};
  TexelImage texture_;
};

TEST_F(PoseRefinerTest, FindsThePoseFromMillimetresAway) {
  for (int k = 0; k < 10; ++k) {
    const Pose truth = looking_at_plane((25 + 6 * k) * kDegree, k, 0.4);
    PlanePicture picture(truth, [](Vec3d p, Vec3d) { return smooth_texture(p); });
    const UncertainPose prior = wrong(truth, k);
    const RefinedPose refined = refine(picture, prior, texture_);
    EXPECT_TRUE(refined.aligned);
    EXPECT_GT(displacement(truth, prior.pose), 1e-3);
    // A tenth of a texel.
    EXPECT_LT(displacement(truth, refined.probe_plane), 1.6e-4) << k;
    EXPECT_LT(refined.error_after, 0.2 * refined.error_before);
  }
}

TEST_F(PoseRefinerTest, AHighlightAndAHandAreOutliers) {
  const Pose truth = looking_at_plane(55 * kDegree, 1, 0.4);
  PlanePicture picture(truth, [](Vec3d p, Vec3d) {
    const Vec3d v = smooth_texture(p);
    if (length(p - Vec3d{0.04, 0.03, 0}) < 0.02) return v + Vec3d{2, 2, 2};
    if (p.y < -0.05 && p.x < 0) return Vec3d{0.3, 0.2, 0.15};
    return v;
  });
  const RefinedPose refined = refine(picture, wrong(truth, 3), texture_);
  EXPECT_TRUE(refined.aligned);
  EXPECT_LT(displacement(truth, refined.probe_plane), 4e-4);
}

TEST_F(PoseRefinerTest, APoseThatContradictsThePriorIsNotUsed) {
  // The picture agrees with a pose 17 mm away, half a period of the texture: 8.5 standard deviations of the prior.
  const UncertainPose prior = wrong(looking_at_plane(55 * kDegree, 1, 0.4), 2);
  const Pose far = compose(prior.pose, Pose{{}, {0.017, 0, 0}});
  PlanePicture picture(far, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  const RefinedPose refined = refine(picture, prior, texture_, far);
  EXPECT_LT(displacement(prior.pose, refined.probe_plane), 0.01);
  EXPECT_GT(refined.error_after, 0.5);
  // It is used where the prior allows it.
  UncertainPose wide = prior;
  for (std::size_t n = 3; n < 6; ++n) wide.covariance[n][n] = 9e-4;
  const RefinedPose allowed = refine(picture, wide, texture_, far);
  EXPECT_LT(displacement(far, allowed.probe_plane), 2e-3);
  EXPECT_LT(allowed.error_after, 0.1);
}

TEST_F(PoseRefinerTest, WithoutTextureThePriorStays) {
  const Pose truth = looking_at_plane(55 * kDegree, 1, 0.4);
  PlanePicture picture(truth, [](Vec3d, Vec3d) { return Vec3d{0.5, 0.5, 0.5}; });
  const TexelImage plain(texels_.count(), {0.5F, 0.5F, 0.5F, 0});
  const UncertainPose prior = wrong(truth, 2);
  EXPECT_LT(displacement(prior.pose, refine(picture, prior, plain).probe_plane), 1e-5);
}

TEST_F(PoseRefinerTest, WithoutAPredictionThePriorStaysAndNothingCanBeSaid) {
  const Pose truth = looking_at_plane(55 * kDegree, 1, 0.4);
  PlanePicture picture(truth, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  const UncertainPose prior = wrong(truth, 2);
  const RefinedPose refined = refine(picture, prior, TexelImage(texels_.count()));
  EXPECT_EQ(refined.probe_plane, prior.pose);
  EXPECT_TRUE(std::isinf(refined.error_after));
}

}  // namespace
}  // namespace lightwell::specular
