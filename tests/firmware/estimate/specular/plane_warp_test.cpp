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

TEST_F(PlaneWarpTest, CellsAreMeansOfTheLuminanceOfTheirTexels) {
  const Pose pose = looking_at_plane(70 * kDegree, 1, 0.4);
  PlanePicture picture(pose, [](Vec3d p, Vec3d) { return smooth_texture(p); });
  ASSERT_TRUE(sample(picture, pose));
  std::vector<float> cells;
  for (const int cell : {1, 2, kTileEdge}) {
    warp_.sample_luminance(pose, cell, cells);
    const int edge = texels_.edge / cell;
    ASSERT_EQ(cells.size(), static_cast<std::size_t>(edge * edge));
    for (int row = 0; row < edge; ++row)
      for (int column = 0; column < edge; ++column) {
        float sum = 0;
        for (int k = 0; k < cell * cell; ++k)
          sum += image_[static_cast<std::size_t>((row * cell + k / cell) * texels_.edge + column * cell + k % cell)]
                     .luminance();
        // Of a tile four points are read; they are not the middles of its texels.
        EXPECT_NEAR(cells[static_cast<std::size_t>(row * edge + column)], sum / static_cast<float>(cell * cell),
                    cell == kTileEdge ? 0.02F : 1e-5F);
      }
  }
}

TEST_F(PlaneWarpTest, ATileWithASaturatedPixelHasNoLuminance) {
  const Pose pose = looking_at_plane(80 * kDegree, 1, 0.4);
  PlanePicture picture(pose, [](Vec3d p, Vec3d) {
    return length(p - Vec3d{0.03, 0.02, 0}) < 0.01 ? Vec3d{1e31, 1, 1} : smooth_texture(p);
  });
  ASSERT_TRUE(sample(picture, pose));
  std::vector<float> texels;
  warp_.sample_luminance(pose, 1, texels);
  int missing = 0;
  for (std::size_t k = 0; k < texels.size(); ++k) {
    EXPECT_EQ(std::isnan(texels[k]), !image_[k].measured()) << k;
    missing += std::isnan(texels[k]) ? 1 : 0;
  }
  EXPECT_GT(missing, 20);
  EXPECT_LT(missing, 200);
}

/// A lens of 640x480.
LensParameters lens_of(const ModelParameters& model, double max_angle_rad) {
  LensParameters lens;
  lens.width = 640, lens.height = 480;
  lens.model = model;
  lens.max_angle_rad = max_angle_rad;
  lens.pose_cv = {upright_lens_cv(), {}};
  return lens;
}

// The grid of exactly projected points becomes as fine as the lens and the view need.
TEST(PlaneWarpCorners, AreWithinTheStatedErrorOfTheExactProjection) {
  const MeiParameters pinhole{560, 560, 319.5, 239.5, 0, 0, 0, 0, 0};
  const MeiParameters distorted{560, 560, 319.5, 239.5, 0, -0.35, 0.15, 0.002, -0.001};
  const KannalaBrandtParameters fisheye{200, 200, 319.5, 239.5, -0.02, 0.01, -0.002, 0};
  const struct {
    const char* name;
    LensParameters lens;
  } lenses[] = {
      {"pinhole", lens_of(pinhole, 0.7)}, {"distorted", lens_of(distorted, 0.65)}, {"fisheye", lens_of(fisheye, 1.6)}};
  for (const auto& [name, lens] : lenses)
    for (const int edge : {64, 256})
      for (const double elevation : {90.0, 45.0, 17.0, 8.0})
        for (const double distance : {0.8, 0.4, 0.2}) {
          RigParameters rig;
          rig.lenses = {lens};
          const PlaneTexels texels{0.2, edge};
          PlaneWarp warp(rig, texels);
          const CameraModel camera(lens);
          const Pose pose = looking_at_plane(elevation * kDegree, 0.7, distance);
          const Pose lens_plane = compose(inverse(lens.pose_cv), pose);
          const auto corners = warp.corners(pose);
          const int count = texels.tiles() + 1;
          ASSERT_EQ(corners.size(), static_cast<std::size_t>(count * count));
          double largest = 0;
          for (int k = 0; k < count * count; ++k) {
            const auto exact =
                camera.project(transformed(lens_plane, texels.point(k % count * kTileEdge, k / count * kTileEdge)));
            const auto& corner = corners[static_cast<std::size_t>(k)];
            ASSERT_EQ(exact.has_value(), !std::isnan(corner.x)) << name;
            if (!exact) continue;
            largest = std::max(largest, std::hypot(static_cast<double>(corner.x) - exact->x,
                                                   static_cast<double>(corner.y) - exact->y));
          }
          EXPECT_LT(largest, PlaneWarp::kMaxCornerError_px)
              << name << " " << edge << " texels, " << elevation << " degrees, " << distance << " m";
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
