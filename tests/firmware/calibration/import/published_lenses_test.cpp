// Tests of the published lenses that other tests use: each sees more than half the sphere, as its source states.
#include "fixtures/published_lenses.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"
#include "calibration/solve/import/readers.hpp"

namespace lightwell {
namespace {

TEST(PublishedLenses, SeeMoreThanHalfTheSphereWithModelsThatGoAsFar) {
  ASSERT_GE(test::published_lenses().size(), 3u);
  for (const test::PublishedLens& published : test::published_lenses()) {
    SCOPED_TRACE(published.name);
    EXPECT_FALSE(published.source.empty());
    const Status valid = test::rig_of(published).validate();
    EXPECT_TRUE(valid.ok()) << valid.message();
    EXPECT_GT(published.lens.max_angle_rad, std::numbers::pi / 2);
    const FieldOfView view = field_of_view(published.lens);
    EXPECT_LE(published.lens.max_angle_rad, view.model_rad);
    EXPECT_DOUBLE_EQ(CameraModel(published.lens).max_angle_rad(), published.lens.max_angle_rad);
  }
}

TEST(PublishedLenses, EveryDirectionComesBackFromItsPixel) {
  for (const test::PublishedLens& published : test::published_lenses()) {
    SCOPED_TRACE(published.name);
    const CameraModel model(published.lens);
    double largest = 0;
    for (int i = 0; i <= 300; ++i) {
      for (int j = 0; j < 48; ++j) {
        const double theta = model.max_angle_rad() * i / 300, phi = 2 * std::numbers::pi * j / 48;
        const Vec3d d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
        const auto pixel = model.project(d);
        ASSERT_TRUE(pixel) << theta << " " << phi;
        const auto back = model.unproject(*pixel);
        ASSERT_TRUE(back) << theta << " " << phi;
        largest = std::max(largest, angle_between(d, *back));
      }
    }
    EXPECT_LT(largest, 1e-9) << "rad";
  }
}

}  // namespace
}  // namespace lightwell
