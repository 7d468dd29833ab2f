// A plane's texels from pictures of it.
#include "estimate/specular/plane_warp.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "plane_pictures.hpp"

namespace lightwell::specular {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

class PlaneWarpTest : public ::testing::Test {
 protected:
  /// Loads a picture seen at a pose and samples it at the same pose.
  bool sample(PlanePicture& picture, const Pose& pose) {
    EXPECT_TRUE(reader_.bind(picture.bracket()).ok());
    if (!warp_.load(reader_, 0, pose, 8, 1)) return false;
    warp_.sample(pose, image_);
    return true;
  }

  const RigParameters rig_ = pinhole_rig();
  const PlaneTexels texels_{0.2, 64};
  estimate::RowReader reader_{rig_};
  PlaneWarp warp_{rig_, texels_};
  TexelImage image_;
};

TEST_F(PlaneWarpTest, TexelsHaveTheRadianceOfTheirPoints) {
  for (const double elevation : {90.0, 60.0, 30.0})
    for (const double azimuth : {0.0, 100.0, 250.0}) {
      const Pose pose = looking_at_plane(elevation * kDegree, azimuth * kDegree, 0.4);
      PlanePicture picture(pose, [](Vec3d p, Vec3d) { return smooth_texture(p); });
      ASSERT_TRUE(sample(picture, pose));
      for (std::size_t k = 0; k < image_.size(); ++k) {
        ASSERT_TRUE(image_[k].measured()) << elevation << " " << azimuth << " " << k;
        const Vec3d truth = smooth_texture(texels_.center(k));
        // Bilinear interpolation: an eighth of the squared pixel times the second derivative of at most 15,000 /m². A
        // pixel at the far edge is 1.7 mm wide, and twice as long at 30 degrees.
        EXPECT_NEAR(image_[k].r, truth.x, elevation > 45 ? 0.008 : 0.027);
      }
    }
}

TEST_F(PlaneWarpTest, TilesAreMeansOfTheirTexels) {
  const Pose pose = looking_at_plane(70 * kDegree, 1, 0.4);
  PlanePicture picture(pose, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  ASSERT_TRUE(sample(picture, pose));
  std::vector<float> tiles;
  warp_.sample_tiles(pose, tiles);
  ASSERT_EQ(tiles.size(), 256U);
  for (int tile = 0; tile < 256; ++tile) {
    float sum = 0;
    for (int k = 0; k < kTileTexels; ++k) sum += image_[texels_.texel_of(tile, k)].luminance() / kTileTexels;
    EXPECT_NEAR(tiles[static_cast<std::size_t>(tile)], sum, 0.02F);
  }
}

TEST_F(PlaneWarpTest, FromBehindOrOutsideThePictureThereIsNothing) {
  const Pose pose = looking_at_plane(60 * kDegree, 0, 0.4);
  PlanePicture picture(pose, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  Pose behind = pose;
  behind.rotation = (pose.rotation * Quat::about({1, 0, 0}, std::numbers::pi)).normalized();
  EXPECT_FALSE(sample(picture, behind));
  Pose beside = pose;
  beside.translation.x += 3;
  EXPECT_FALSE(sample(picture, beside));
  Pose invalid = pose;
  invalid.translation.z = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(sample(picture, invalid));
}

TEST_F(PlaneWarpTest, TexelsBeyondThePictureAreUnseenAndTheOthersAreRight) {
  const Pose pose = looking_at_plane(80 * kDegree, 0, 0.15);
  PlanePicture picture(pose, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  ASSERT_TRUE(sample(picture, pose));
  int seen = 0;
  for (std::size_t k = 0; k < image_.size(); ++k) {
    if (!image_[k].seen()) continue;
    ++seen;
    EXPECT_NEAR(image_[k].g, smooth_texture(texels_.center(k)).y, 0.01);
  }
  EXPECT_GT(seen, 500);
  EXPECT_LT(seen, 4000);
}

TEST_F(PlaneWarpTest, ThePixelOnThePlaneIsThatOfThePinhole) {
  const Pose pose = looking_at_plane(30 * kDegree, 2, 0.5);
  PlanePicture picture(pose, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  ASSERT_TRUE(sample(picture, pose));
  EXPECT_NEAR(warp_.pixel_rad(pose), 1 / kFocal_px, 2e-5);
  // Twice as long as wide at 30 degrees.
  EXPECT_NEAR(warp_.pixel_on_plane(pose), 2 * 0.5 / kFocal_px, 2e-5);
}

}  // namespace
}  // namespace lightwell::specular
