// Tests of published lenses beyond 180 degrees: project() and unproject() are inverse over the whole field of view.
#include "fixtures/published_lenses.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"

namespace lightwell {
namespace {

using std::numbers::pi;

class PublishedLens : public testing::TestWithParam<test::PublishedLens> {};

TEST_P(PublishedLens, SeesMoreThanHalfTheSphere) { EXPECT_GT(CameraModel(GetParam().lens).max_angle_rad(), pi / 2); }

TEST_P(PublishedLens, PixelsComeBack) {
  const LensParameters& lens = GetParam().lens;
  const CameraModel exact(lens);
  int seen = 0;
  for (int y = 0; y < lens.height; y += 5) {
    for (int x = 0; x < lens.width; x += 5) {
      const auto d = exact.unproject({x + 0.3, y - 0.2});
      if (!d) continue;
      const auto back = exact.project(*d);
      ASSERT_TRUE(back) << x << " " << y;
      EXPECT_LT(std::hypot(back->x - (x + 0.3), back->y - (y - 0.2)), 1e-5) << x << " " << y;
      ++seen;
    }
  }
  EXPECT_GT(seen, 5000);
}

TEST_P(PublishedLens, DirectionsComeBackUpToTheEdge) {
  const CameraModel model(GetParam().lens);
  for (int i = 0; i <= 300; ++i) {
    for (int j = 0; j < 24; ++j) {
      const double theta = model.max_angle_rad() * i / 300, phi = 2 * pi * j / 24;
      const Vec3d d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
      const auto pixel = model.project(d);
      ASSERT_TRUE(pixel) << "theta " << theta << " phi " << phi;
      const auto back = model.unproject(*pixel);
      ASSERT_TRUE(back) << "theta " << theta << " phi " << phi;
      EXPECT_LT(angle_between(*back, d), 1e-7) << "theta " << theta << " phi " << phi;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PublishedLens, testing::ValuesIn(test::published_lenses()), [](const auto& each) {
  std::string name;
  for (const char c : each.param.name) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
});

}  // namespace
}  // namespace lightwell
