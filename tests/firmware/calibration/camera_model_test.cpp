// Tests of the camera classes, the same for each, through CameraModel: project() and unproject() are inverse over the
// whole domain, derivatives, special directions. Then properties of single models.
#include "calibration/model/camera_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <variant>

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <lightwell/equirect.hpp>

#include "calibration/model/cameras.hpp"

namespace lightwell {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;
// Pixels are about 1000, angles about 1: a thousand times the rounding error of double.
constexpr double kPixelTolerance = 1e-9;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

LensParameters lens_with(ModelParameters model, double max_angle_rad) {
  LensParameters lens;
  lens.width = 1000;
  lens.height = 500;
  lens.model = model;
  lens.max_angle_rad = max_angle_rad;
  lens.pose_cv.rotation = upright_lens_cv();
  return lens;
}

Vec3d direction_cv(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// The pixel of the axis.
PixelPosition principal_point(const LensParameters& lens) {
  return std::visit(
      [&](const auto& p) {
        if constexpr (requires { p.cx; }) return PixelPosition{p.cx, p.cy};
        return PixelPosition{0.5 * (lens.width - 1), 0.5 * (lens.height - 1)};
      },
      lens.model);
}

// A camera class and a lens of it.
struct KannalaBrandtExample {
  template <class T>
  using Camera = KannalaBrandtCamera<T>;
  static LensParameters lens() {
    return lens_with(KannalaBrandtParameters{290, 288, 501.3, 247.9, -0.03, 0.004, -0.0011, 1e-4}, 100 * kDegree);
  }
};
struct DoubleSphereExample {
  template <class T>
  using Camera = DoubleSphereCamera<T>;
  static LensParameters lens() {
    return lens_with(DoubleSphereParameters{300, 305, 498.2, 251.0, -0.2, 0.61}, 105 * kDegree);
  }
};
struct MeiExample {
  template <class T>
  using Camera = MeiCamera<T>;
  // Typical result of OpenCV's omnidir for a lens of 190 degrees.
  static LensParameters lens() {
    return lens_with(MeiParameters{720, 718, 499.1, 248.2, 1.4, -0.12, 0.21, 3e-4, -7e-4}, 97 * kDegree);
  }
};
struct EquirectangularExample {
  template <class T>
  using Camera = EquirectangularCamera;
  static LensParameters lens() { return lens_with(EquirectangularParameters{}, kPi); }
};

/// Number of parameters that a solver estimates.
template <class Example>
constexpr std::size_t kParameters = Example::template Camera<double>::kParameters;

template <class Example>
class CameraTest : public testing::Test {
 protected:
  const LensParameters lens = Example::lens();
  const CameraModel model{lens};

  /// Calls f with directions over the whole domain, including its edge.
  template <class F>
  void for_directions(F f) const {
    constexpr int kThetas = 400, kPhis = 37;
    for (int i = 0; i <= kThetas; ++i) {
      for (int j = 0; j < kPhis; ++j) {
        const double theta = model.max_angle_rad() * i / kThetas;
        // Straight behind, the azimuth and so the pixel are undefined.
        if (theta < kPi) f(direction_cv(theta, 2 * kPi * j / kPhis));
      }
    }
  }
};

using Examples = testing::Types<KannalaBrandtExample, DoubleSphereExample, MeiExample, EquirectangularExample>;
TYPED_TEST_SUITE(CameraTest, Examples);

TYPED_TEST(CameraTest, UnprojectUndoesProject) {
  this->for_directions([&](Vec3d d) {
    const auto pixel = this->model.project(d);
    ASSERT_TRUE(pixel) << d.x << " " << d.y << " " << d.z;
    const auto back = this->model.unproject(*pixel);
    ASSERT_TRUE(back) << pixel->x << " " << pixel->y;
    // One pixel is about 1/300 rad.
    EXPECT_LT(angle_between(*back, d), kPixelTolerance / 300) << d.x << " " << d.y << " " << d.z;
    EXPECT_NEAR(length(*back), 1, 1e-14);
  });
}

TYPED_TEST(CameraTest, ProjectUndoesUnproject) {
  int seen = 0;
  for (int y = 0; y < 500; y += 7) {
    for (int x = 0; x < 1000; x += 7) {
      const auto d = this->model.unproject({x + 0.25, y - 0.125});
      if (!d) continue;
      const auto pixel = this->model.project(*d);
      ASSERT_TRUE(pixel) << x << " " << y;
      EXPECT_NEAR(pixel->x, x + 0.25, kPixelTolerance);
      EXPECT_NEAR(pixel->y, y - 0.125, kPixelTolerance);
      ++seen;
    }
  }
  EXPECT_GT(seen, 2000);
}

TYPED_TEST(CameraTest, LengthOfTheDirectionDoesNotMatter) {
  const Vec3d d = direction_cv(1.2, 0.3);
  for (const double scale : {1e-200, 1e-3, 1e200}) {
    const auto a = this->model.project(d), b = this->model.project(d * scale);
    ASSERT_TRUE(a && b) << scale;
    EXPECT_NEAR(a->x, b->x, kPixelTolerance);
    EXPECT_NEAR(a->y, b->y, kPixelTolerance);
  }
}

TYPED_TEST(CameraTest, InvalidDirectionsHaveNoPixel) {
  EXPECT_FALSE(this->model.project({0, 0, 0}));
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_FALSE(this->model.project({bad, 0, 1}));
    EXPECT_FALSE(this->model.project({0, bad, 1}));
    EXPECT_FALSE(this->model.project({0, 0, bad}));
    EXPECT_FALSE(this->model.unproject({bad, 0}));
    EXPECT_FALSE(this->model.unproject({0, bad}));
  }
}

TYPED_TEST(CameraTest, TheAxisHasThePrincipalPoint) {
  const PixelPosition center = principal_point(this->lens);
  const auto pixel = this->model.project({0, 0, 1});
  ASSERT_TRUE(pixel);
  EXPECT_EQ(pixel->x, center.x);
  EXPECT_EQ(pixel->y, center.y);
  const auto back = this->model.unproject(center);
  ASSERT_TRUE(back);
  EXPECT_LT(angle_between(*back, Vec3d{0, 0, 1}), 1e-15);
}

TYPED_TEST(CameraTest, TheDomainEndsAtTheLargestAngle) {
  const double end = this->model.max_angle_rad();
  if (end == kPi) {
    EXPECT_TRUE(this->model.project({0, 0, -1})) << "the equirectangular domain is the whole sphere";
    return;
  }
  EXPECT_FALSE(this->model.project({0, 0, -1})) << "behind the camera";
  for (int j = 0; j < 16; ++j) {
    const double phi = 2 * kPi * j / 16;
    const auto edge = this->model.project(direction_cv(end - 1e-9, phi));
    ASSERT_TRUE(edge);
    EXPECT_FALSE(this->model.project(direction_cv(end + 1e-9, phi)));
    const auto axis = this->model.project({0, 0, 1});
    ASSERT_TRUE(axis);
    const auto outwards = [&](double s) {
      return PixelPosition{axis->x + (edge->x - axis->x) * s, axis->y + (edge->y - axis->y) * s};
    };
    EXPECT_TRUE(this->model.unproject(outwards(1 - 1e-7)));
    EXPECT_FALSE(this->model.unproject(outwards(1 + 1e-7)));
  }
}

TYPED_TEST(CameraTest, SolversNeedNoUnitVectors) {
  if constexpr (kParameters<TypeParam> != 0) {
    const auto camera = TypeParam::template Camera<double>::from(parameters_of(this->lens.model).data());
    double u = 0, v = 0, u2 = 0, v2 = 0;
    ASSERT_TRUE(camera.project(0.3, -0.8, 0.1, u, v));
    ASSERT_TRUE(camera.project(3e5, -8e5, 1e5, u2, v2));
    EXPECT_NEAR(u, u2, kPixelTolerance);
    EXPECT_NEAR(v, v2, kPixelTolerance);
    EXPECT_FALSE(camera.project(0.0, 0.0, 0.0, u, v));
  }
}

/// The pixel as a function of the camera's parameters and a direction, in one array.
template <class Camera, class T>
std::array<T, 2> pixel_of(const T* parameters_and_direction) {
  const T* d = parameters_and_direction + Camera::kParameters;
  std::array<T, 2> out{};
  EXPECT_TRUE(Camera::from(parameters_and_direction).project(d[0], d[1], d[2], out[0], out[1]));
  return out;
}

TYPED_TEST(CameraTest, AutomaticDerivativesEqualFiniteDifferences) {
  if constexpr (kParameters<TypeParam> != 0) {
    constexpr std::size_t kLens = kParameters<TypeParam>, kCount = kLens + 3;
    using Jet = ceres::Jet<double, static_cast<int>(kCount)>;
    using Camera = typename TypeParam::template Camera<double>;
    using JetCamera = typename TypeParam::template Camera<Jet>;
    std::array<double, kCount> at{};
    std::ranges::copy(parameters_of(this->lens.model), at.begin());
    this->for_directions([&](Vec3d d) {
      // At distance two, so that a nonzero derivative along the ray would be detected.
      at[kLens] = 2 * d.x, at[kLens + 1] = 2 * d.y, at[kLens + 2] = 2 * d.z;
      std::array<Jet, kCount> jets;
      for (std::size_t k = 0; k < kCount; ++k) jets[k] = Jet(at[k], static_cast<int>(k));
      const std::array<Jet, 2> p = pixel_of<JetCamera>(jets.data());
      for (std::size_t k = 0; k < kCount; ++k) {
        // About the cube root of the precision: the optimal step of central differences.
        const double step = 6e-6 * std::max(1.0, std::abs(at[k]));
        auto more = at, less = at;
        more[k] += step, less[k] -= step;
        const auto up = pixel_of<Camera>(more.data()), down = pixel_of<Camera>(less.data());
        for (std::size_t c = 0; c < 2; ++c) {
          const double slope = (up[c] - down[c]) / (2 * step);
          EXPECT_NEAR(p[c].v[static_cast<Eigen::Index>(k)], slope, 2e-6 * (1 + std::abs(slope)))
              << "direction " << d.x << " " << d.y << " " << d.z << " number " << k << " coordinate " << c;
        }
      }
    });
  }
}

TEST(Mei, WithXiZeroIsAPinhole) {
  const CameraModel model(lens_with(MeiParameters{100, 200, 7, 9, 0, 0, 0, 0, 0}, kPi));
  const auto p = model.project({0.3, -0.2, 2});
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->x, 7 + 100 * 0.15, kPixelTolerance);
  EXPECT_NEAR(p->y, 9 - 200 * 0.1, kPixelTolerance);
  EXPECT_NEAR(model.max_angle_rad(), kPi / 2, 1e-6) << "a pinhole sees half the sphere";
}

TEST(Mei, TangentialTermsAreInOpenCvsOrder) {
  // OpenCV, calib3d: x'' = x + 2 p1 x y + p2 (r² + 2 x²), y'' = y + p1 (r² + 2 y²) + 2 p2 x y. At (1/2, 0) p1 changes
  // only y.
  const auto first = CameraModel(lens_with(MeiParameters{100, 100, 0, 0, 0, 0, 0, 0.01, 0}, 1)).project({0.5, 0, 1});
  ASSERT_TRUE(first);
  EXPECT_NEAR(first->x, 50, kPixelTolerance);
  EXPECT_NEAR(first->y, 0.25, kPixelTolerance);
  const auto second = CameraModel(lens_with(MeiParameters{100, 100, 0, 0, 0, 0, 0, 0, 0.01}, 1)).project({0.5, 0, 1});
  ASSERT_TRUE(second);
  EXPECT_NEAR(second->x, 50.75, kPixelTolerance);
  EXPECT_NEAR(second->y, 0, kPixelTolerance);
}

TEST(Mei, WithXiOneItIsStereographic) {
  const CameraModel model(lens_with(MeiParameters{100, 100, 0, 0, 1, 0, 0, 0, 0}, 3));
  for (const double theta : {0.1, 1.0, 2.0, 2.9}) {
    const auto p = model.project(direction_cv(theta, 0));
    ASSERT_TRUE(p);
    EXPECT_NEAR(p->x / (100 * std::tan(theta / 2)), 1, 1e-12);
  }
}

TEST(Mei, EndsWhereTheSphereIsSeenEdgeOn) {
  const CameraModel model(lens_with(MeiParameters{100, 100, 0, 0, 2, 0, 0, 0, 0}, kPi));
  EXPECT_NEAR(model.max_angle_rad(), std::acos(-0.5), 1e-6);
  EXPECT_FALSE(model.project(direction_cv(2.2, 1)));
}

TEST(Mei, EndsWhereItsDistortionFoldsThePicture) {
  // d/dr of r - 0.1 r³ is zero at r = sqrt(1 / 0.3).
  const CameraModel model(lens_with(MeiParameters{100, 100, 0, 0, 1, -0.1, 0, 0, 0}, 3));
  EXPECT_NEAR(2 * std::tan(model.max_angle_rad() / 2) / 2, std::sqrt(1 / 0.3), 1e-6);
}

TEST(KannalaBrandt, RadiusGrowsWithTheAngleBeyondNinetyDegrees) {
  KannalaBrandtParameters k;
  k.fx = 100;
  k.fy = 200;
  k.cx = 7;
  k.cy = 9;
  const CameraModel model(lens_with(k, 3));
  // With all k = 0 the radius is the angle times the focal length (pixels per rad).
  const auto right = model.project(direction_cv(2.5, 0)), down = model.project(direction_cv(2.5, kPi / 2));
  ASSERT_TRUE(right && down);
  EXPECT_NEAR(right->x, 7 + 250, kPixelTolerance);
  EXPECT_NEAR(right->y, 9, kPixelTolerance);
  EXPECT_NEAR(down->x, 7, kPixelTolerance);
  EXPECT_NEAR(down->y, 9 + 500, kPixelTolerance);
}

TEST(KannalaBrandt, EndsAtTheMaximumOfTheRadius) {
  KannalaBrandtParameters k;
  k.fx = k.fy = 100;
  k.k1 = -0.2;
  // dr/dtheta = 1 - 0.6 theta² = 0.
  const double turning = std::sqrt(1 / 0.6);
  const CameraModel model(lens_with(k, 1.7));
  EXPECT_NEAR(model.max_angle_rad(), turning, 1e-12);
  EXPECT_TRUE(model.project(direction_cv(turning - 1e-6, 1)));
  EXPECT_FALSE(model.project(direction_cv(turning + 1e-6, 1)));
  // Both branches reach this radius; the result must be the one nearer to the axis.
  const auto d = model.unproject({0.99 * 100 * turning * (1 - 0.2 / 0.6), 0});
  ASSERT_TRUE(d);
  EXPECT_LT(std::atan2(d->x, d->z), turning);
}

TEST(DoubleSphere, EndsWhereTheProjectionIsNoLongerOneToOne) {
  for (const double alpha : {0.3, 0.5, 0.61, 0.9}) {
    for (const double xi : {-0.3, 0.0, 0.4}) {
      const CameraModel model(lens_with(DoubleSphereParameters{1, 1, 0, 0, xi, alpha}, kPi));
      // Usenko et al. 2018, eq. 43 to 45.
      const double w1 = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
      const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
      EXPECT_GE(std::cos(model.max_angle_rad()), -w2 - 1e-12);
      EXPECT_NEAR(std::cos(model.max_angle_rad()), -w2, 0.1) << "the domain must not be smaller than necessary";
      double before = 0;
      for (int i = 1; i <= 200; ++i) {
        // Exclude the end itself, which is at infinity for alpha = 1/2.
        const auto p = model.project(direction_cv(model.max_angle_rad() * i / 200.01, 0));
        ASSERT_TRUE(p);
        EXPECT_GT(p->x, before) << "alpha " << alpha << " xi " << xi << " step " << i;
        before = p->x;
      }
    }
  }
}

TEST(Equirectangular, UprightEqualsEquirectUv) {
  const LensParameters lens = EquirectangularExample::lens();
  const CameraModel model(lens);
  for (int j = 0; j < 500; j += 9) {
    for (int i = 0; i < 1000; i += 9) {
      const auto cv = model.unproject({static_cast<double>(i), static_cast<double>(j)});
      ASSERT_TRUE(cv);
      const Vec3d d = rotate(lens.pose_cv.rotation, *cv);
      EXPECT_LT(angle_between(d, equirect_direction((i + 0.5) / 1000, (j + 0.5) / 500)), 1e-14);
    }
  }
}

TEST(UprightLens, RightIsPlusXAndUpIsPlusY) {
  const LensParameters lens = KannalaBrandtExample::lens();
  const CameraModel model(lens);
  const auto seen = [&](Vec3d probe) { return model.project(rotate(lens.pose_cv.rotation.inverse(), probe)).value(); };
  const PixelPosition ahead = seen({0, 0, -1});
  EXPECT_NEAR(ahead.x, 501.3, kPixelTolerance);
  EXPECT_NEAR(ahead.y, 247.9, kPixelTolerance);
  EXPECT_GT(seen({0.1, 0, -1}).x, ahead.x);
  EXPECT_LT(seen({0, 0.1, -1}).y, ahead.y) << "up in the world must be a smaller row";
}

}  // namespace
}  // namespace lightwell
