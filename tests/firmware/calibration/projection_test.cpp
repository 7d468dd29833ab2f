// Tests that the automatic derivatives of projections equal finite differences.
#include "calibration/model/projection.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <ceres/jet.h>
#include <gtest/gtest.h>

namespace lightwell {
namespace {

template <class Model>
struct Example;
template <>
struct Example<KannalaBrandtModel> {
  static constexpr std::array<double, 8> kValues{290, 288, 501.3, 247.9, -0.03, 0.004, -0.0011, 1e-4};
};
template <>
struct Example<DoubleSphereModel> {
  static constexpr std::array<double, 6> kValues{300, 305, 498.2, 251.0, -0.2, 0.61};
};
template <>
struct Example<MeiModel> {
  static constexpr std::array<double, 9> kValues{720, 718, 499.1, 248.2, 1.4, -0.12, 0.21, 3e-4, -7e-4};
};

template <class Model>
class Projection : public testing::Test {};
using Models = testing::Types<KannalaBrandtModel, DoubleSphereModel, MeiModel>;
TYPED_TEST_SUITE(Projection, Models);

/// Projection as a function of the concatenated lens parameters and direction.
template <class Model, class T>
std::array<T, 2> pixel(const T* x) {
  std::array<T, 2> out;
  EXPECT_TRUE(
      Model::project(x, x[Model::kParameters], x[Model::kParameters + 1], x[Model::kParameters + 2], out[0], out[1]));
  return out;
}

TYPED_TEST(Projection, DerivativesEqualFiniteDifferences) {
  constexpr std::size_t kCount = TypeParam::kParameters + 3;
  using Jet = ceres::Jet<double, static_cast<int>(kCount)>;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j < 9; ++j) {
      const double theta = 97 * std::numbers::pi / 180 * i / 20, phi = 0.3 + 2 * std::numbers::pi * j / 9;
      std::array<double, kCount> at{};
      std::copy_n(Example<TypeParam>::kValues.begin(), TypeParam::kParameters, at.begin());
      // At distance two, so that a nonzero derivative along the ray would be detected.
      at[kCount - 3] = 2 * std::sin(theta) * std::cos(phi);
      at[kCount - 2] = 2 * std::sin(theta) * std::sin(phi);
      at[kCount - 1] = 2 * std::cos(theta);
      std::array<Jet, kCount> jets;
      for (std::size_t k = 0; k < kCount; ++k) jets[k] = Jet(at[k], static_cast<int>(k));
      const std::array<Jet, 2> p = pixel<TypeParam>(jets.data());
      for (std::size_t k = 0; k < kCount; ++k) {
        // About the cube root of the precision: the optimal step of central differences.
        const double step = 6e-6 * std::max(1.0, std::abs(at[k]));
        auto more = at, less = at;
        more[k] += step, less[k] -= step;
        const auto up = pixel<TypeParam>(more.data()), down = pixel<TypeParam>(less.data());
        for (std::size_t c = 0; c < 2; ++c) {
          const double slope = (up[c] - down[c]) / (2 * step);
          EXPECT_NEAR(p[c].v[static_cast<Eigen::Index>(k)], slope, 2e-6 * (1 + std::abs(slope)))
              << "theta " << theta << " phi " << phi << " number " << k << " coordinate " << c;
        }
      }
    }
  }
}

TYPED_TEST(Projection, LengthDoesNotMatter) {
  const auto& p = Example<TypeParam>::kValues;
  double u = 0, v = 0, u2 = 0, v2 = 0;
  ASSERT_TRUE(TypeParam::project(p.data(), 0.3, -0.8, 0.1, u, v));
  ASSERT_TRUE(TypeParam::project(p.data(), 3e5, -8e5, 1e5, u2, v2));
  EXPECT_NEAR(u, u2, 1e-9);
  EXPECT_NEAR(v, v2, 1e-9);
}

TYPED_TEST(Projection, OnTheAxisThereIsAPixelAndBehindItNone) {
  const auto& p = Example<TypeParam>::kValues;
  double u = 0, v = 0;
  ASSERT_TRUE(TypeParam::project(p.data(), 0.0, 0.0, 1.0, u, v));
  EXPECT_EQ(u, p[2]);
  EXPECT_EQ(v, p[3]);
  EXPECT_FALSE(TypeParam::project(p.data(), 0.0, 0.0, 0.0, u, v));
}

}  // namespace
}  // namespace lightwell
