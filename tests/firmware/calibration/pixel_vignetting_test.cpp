// Tests of PixelVignetting against the tables of make_rig_table().
#include "calibration/model/pixel_vignetting.hpp"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "calibration/model/lens_table.hpp"
#include "calibration/model/response.hpp"

namespace lightwell {
namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr double kMaxAngle = 60 * std::numbers::pi / 180;

/// The rim of the field of view is a circle of 33 pixels in the picture.
LensParameters lens_of(const ModelParameters& model) {
  LensParameters lens;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.model = model;
  lens.max_angle_rad = kMaxAngle;
  lens.pose_cv.rotation = upright_lens_cv();
  lens.photometry.vignetting = {-0.2, 0.03, -0.003};
  return lens;
}

TEST(PixelVignetting, EqualsTheTableWithinTheFieldOfView) {
  const ModelParameters models[] = {KannalaBrandtParameters{32, 32, 47.5, 35.5, -0.018, 0.0025, -0.0011, 1e-4},
                                    DoubleSphereParameters{22, 22, 47.7, 35.2, -0.2, 0.6},
                                    MeiParameters{19, 19, 47.5, 35.5, 0, -0.01, 0, 1e-3, 0}};
  for (const ModelParameters& model : models) {
    const LensParameters lens = lens_of(model);
    const Result<RigTable> rig_table = make_rig_table({{lens}, 0});
    ASSERT_TRUE(rig_table.ok()) << rig_table.status().message();
    const LensTable& table = rig_table->lenses[0];
    PixelVignetting vignetting_of_pixels(lens);
    const CameraModel camera(lens);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const float truth = table.inverse_vignetting[table.index(x, y)];
        const float value = *vignetting_of_pixels.inverse(y, x, x + 1);
        if (truth == 0) continue;
        // The table's direction of a pixel that the rim crosses is the centroid of its visible part, up to 0.7 px from
        // its centre. At the rim, a pixel is 0.035 rad wide and vignetting falls by 0.35 of its value per rad.
        const bool on_rim = camera.max_angle_rad() -
                                angle_between(vec_cast<double>(table.direction[table.index(x, y)]), Vec3d{0, 0, -1}) <
                            0.06;
        if (on_rim)
          EXPECT_NEAR(value / truth, 1, 0.7 * 0.035 * 0.35) << x << ", " << y;
        else
          EXPECT_EQ(value, truth) << x << ", " << y;
      }
    }
  }
}

TEST(PixelVignetting, BeyondTheFieldOfViewItIsThatOfItsEdge) {
  const LensParameters lens = lens_of(KannalaBrandtParameters{32, 32, 47.5, 35.5, 0, 0, 0, 0});
  PixelVignetting pixels(lens);
  EXPECT_FLOAT_EQ(*pixels.inverse(0, 0, 1), static_cast<float>(1 / vignetting(lens.photometry, kMaxAngle)));
}

TEST(PixelVignetting, ReadsRunsInAnyOrder) {
  const LensParameters lens = lens_of(KannalaBrandtParameters{32, 32, 47.5, 35.5, 0, 0, 0, 0});
  PixelVignetting pixel_by_pixel(lens), by_runs(lens);
  for (const auto& [first, end] : {std::pair{40, 60}, std::pair{30, 50}, std::pair{0, kWidth}}) {
    const float* run = by_runs.inverse(35, first, end);
    for (int x = first; x < end; ++x) EXPECT_EQ(run[x - first], *pixel_by_pixel.inverse(35, x, x + 1)) << x;
  }
}

TEST(PixelVignetting, OfALensWithoutVignettingIsOneRowOfOnes) {
  LensParameters lens = lens_of(KannalaBrandtParameters{32, 32, 47.5, 35.5, 0, 0, 0, 0});
  lens.photometry.vignetting = {};
  PixelVignetting pixels(lens);
  const float* row = pixels.inverse(0, 0, kWidth);
  EXPECT_EQ(std::count(row, row + kWidth, 1.0F), kWidth);
  EXPECT_EQ(pixels.inverse(kHeight - 1, 0, kWidth), row) << "the rows share their memory, and none is evaluated";
}

}  // namespace
}  // namespace lightwell
