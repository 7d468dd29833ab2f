// Camera models, against closed forms.
#include "reference/camera.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "reference/panorama.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

/// project(unproject) and unproject(project) are the identity for all angles below `end` (rad).
template <class Camera>
void expect_round_trip(const Camera& camera, double end) {
  for (double theta = 0; theta < end; theta += 0.03) {
    for (double azimuth = 0; azimuth < 6.2; azimuth += 0.37) {
      const V3 d{std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth), std::cos(theta)};
      const V2 image = project(camera, 2.5 * d).value();
      const V3 back = unproject(camera, image).value();
      // Bisection ends at neighbouring doubles; pixels of about 1e3 with focal lengths of about
      // 300 have an error of 1e-13 / 300, divided by the slope of the radius (above 0.01 here).
      EXPECT_LT(distance(back, d), 1e-13);
      const V2 again = project(camera, back).value();
      EXPECT_LT(std::hypot(again.x - image.x, again.y - image.y), 3e-12);
    }
  }
}

TEST(Camera, KannalaBrandt) {
  const KannalaBrandt plain{300, 310, 640, 480, 0, 0, 0, 0};
  EXPECT_NEAR(project(plain, {1, 0, 0}).value().x, 640 + 300 * pi / 2, 1e-12);
  EXPECT_NEAR(project(plain, {0, -1, -1}).value().y, 480 - 310 * 3 * pi / 4, 1e-12);
  EXPECT_FALSE(project(plain, {0, 0, 0}).has_value());
  EXPECT_FALSE(unproject(plain, {640 + 300 * 3.2, 480}).has_value());

  const KannalaBrandt bent{300, 310, 640, 480, 0.02, -0.01, 0.003, -0.0004};
  const double t = 0.8;
  const double r = t + 0.02 * std::pow(t, 3) - 0.01 * std::pow(t, 5) + 0.003 * std::pow(t, 7) - 0.0004 * std::pow(t, 9);
  EXPECT_NEAR(project(bent, {0, std::sin(t), std::cos(t)}).value().y, 480 + 310 * r, 1e-12);
  expect_round_trip(plain, 3.1);
  expect_round_trip(bent, 0.95 * largest_theta(bent));

  // r = theta - theta^3 / 9 turns at theta = sqrt 3, where r = 2 sqrt 3 / 3.
  const KannalaBrandt turning{100, 100, 0, 0, -1.0 / 9, 0, 0, 0};
  EXPECT_NEAR(largest_theta(turning), std::sqrt(3.0), rounding);
  EXPECT_FALSE(project(turning, {std::sin(1.74), 0, std::cos(1.74)}).has_value());
  EXPECT_FALSE(unproject(turning, {116, 0}).has_value());
}

TEST(Camera, DoubleSphere) {
  // xi = 0: alpha = 0 is the pinhole x / z, alpha = 1/2 the stereographic 2 tan(theta / 2).
  const V2 pinhole = project(DoubleSphere{300, 310, 640, 480, 0, 0}, {1, 2, 4}).value();
  EXPECT_NEAR(pinhole.x, 640 + 300 * 0.25, 1e-12);
  EXPECT_NEAR(pinhole.y, 480 + 310 * 0.5, 1e-12);
  const DoubleSphere stereographic{300, 300, 640, 480, 0, 0.5};
  const double edge = 640 + 600 * std::tan(3 * pi / 8);
  EXPECT_NEAR(project(stereographic, {1, 0, -1}).value().x, edge, 1e-11);
  EXPECT_NEAR(largest_theta(stereographic), pi, rounding);

  // The paper's formula, term by term.
  const DoubleSphere wide{300, 310, 640, 480, -0.2, 0.6};
  const V3 point{0.3, -0.8, -0.1};
  const double d1 = length(point), shifted = -0.2 * d1 + point.z;
  const double d2 = std::hypot(point.x, point.y, shifted);
  const double denominator = 0.6 * d2 + 0.4 * shifted;
  EXPECT_NEAR(project(wide, point).value().x, 640 + 300 * 0.3 / denominator, 1e-11);
  EXPECT_NEAR(project(wide, point).value().y, 480 - 310 * 0.8 / denominator, 1e-11);

  for (const double xi : {-0.3, 0.0, 0.4}) {
    // Above one half the radius is flat at its turning, at 1 / sqrt(2 alpha - 1).
    const DoubleSphere camera{300, 310, 640, 480, xi, 0.65};
    const double end = largest_theta(camera), turning = turning_theta(camera);
    EXPECT_NEAR(radius(camera, turning), 1 / std::sqrt(0.3), rounding);
    EXPECT_LT(radius(camera, turning - 1e-3), radius(camera, turning));
    EXPECT_LT(radius(camera, turning + 1e-3), radius(camera, turning));
    EXPECT_LE(end, turning + rounding);
    EXPECT_FALSE(project(camera, {std::sin(end + 1e-6), 0, std::cos(end + 1e-6)}).has_value());
    EXPECT_TRUE(unproject(camera, {640 + 300 / std::sqrt(0.3) - 0.01, 480}).has_value());
    EXPECT_FALSE(unproject(camera, {640 + 300 / std::sqrt(0.3) + 0.01, 480}).has_value());
    // Before the flat end, where the inverse is ill-conditioned.
    expect_round_trip(camera, 0.9 * end);
    // Below one half the radius is unbounded, and so are the pixels: keep to 0.8.
    const DoubleSphere narrow{300, 310, 640, 480, xi, 0.3};
    expect_round_trip(narrow, 0.8 * largest_theta(narrow));
  }
}

TEST(Camera, EquirectangularIsTheRotatedPanoramaMapping) {
  const Equirectangular camera{64, 32};
  for (int j = 0; j < 32; ++j) {
    for (int i = 0; i < 64; ++i) {
      const V3 d = pixel_direction(i, j, 64, 32);
      const V3 d_cv{d.x, -d.y, -d.z};
      EXPECT_LT(distance(unproject(camera, {i + 0.0, j + 0.0}).value(), d_cv), rounding);
      const V2 image = project(camera, 3 * d_cv).value();
      // 64 pixels per turn, atan2 to 4e-16: near the poles the azimuth loses a digit.
      EXPECT_NEAR(image.x, i, 1e-12);
      EXPECT_NEAR(image.y, j, 1e-12);
    }
  }
  EXPECT_FALSE(unproject(camera, {-0.6, 3}).has_value());
}

}  // namespace
}  // namespace lightwell::reference
