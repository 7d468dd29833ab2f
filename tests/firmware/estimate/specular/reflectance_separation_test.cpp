// The separation of diffuse and specular radiance on light fields of known parts.
#include "estimate/specular/reflectance_separation.hpp"

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace lightwell::specular {
namespace {

class ReflectanceSeparationTest : public ::testing::Test {
 protected:
  /// Reflection of a soft light, whose highlight is 20 degrees wide, on a dim surround.
  static double specular(Vec3d v) {
    const double angle = angle_between(v, Vec3d{0.4, 0.3, 0.87});
    return 0.4 * std::exp(-angle * angle / 0.06);
  }
  double diffuse(std::size_t texel) const {
    const Vec3d p = texels_.center(texel);
    return 0.3 + 0.2 * std::sin(200 * p.x) * std::cos(150 * p.y);
  }
  static Vec3d lens(int k, int count) {
    const Vec3d d = fibonacci_direction(k, 2 * count);
    return Vec3d{d.x, d.y, d.z + 0.02} * 0.4;
  }
  /// Adds `count` views of the whole hemisphere; `change(texel, k, radiance)` may change a sample.
  template <class Change>
  void capture(int count, Change&& change) {
    TexelImage image(texels_.count());
    for (int k = 0; k < count; ++k) {
      const Vec3d from = lens(k, count);
      for (std::size_t texel = 0; texel < image.size(); ++texel) {
        auto v = static_cast<float>(diffuse(texel) + specular(from - texels_.center(texel)));
        change(texel, k, v);
        image[texel] = {v, v, v, v > 1 ? 1.0F : 0.0F};
      }
      separation_.add_to_medians(image, field_.add(image, {from, 0.001}, static_cast<std::uint32_t>(k)));
      separation_.add_clipped(image, from);
    }
  }
  /// RMS of D + S against the truth over new views.
  double error() const {
    double squares = 0, count = 0;
    TexelImage image;
    for (int k = 0; k < 40; ++k) {
      const Vec3d from = lens(k, 40);
      separation_.predict(from, image);
      for (std::size_t texel = 0; texel < image.size(); ++texel) {
        const double truth = diffuse(texel) + specular(from - texels_.center(texel));
        squares += std::pow(static_cast<double>(image[texel].g) - truth, 2);
        ++count;
      }
    }
    return std::sqrt(squares / count);
  }

  const PlaneTexels texels_{0.2, 32};
  SurfaceLightField field_{texels_, 60, 64U << 20U};
  ReflectanceSeparation separation_{texels_, 40};
};

TEST_F(ReflectanceSeparationTest, FindsBothPartsUpToAConstant) {
  capture(400, [](std::size_t, int, float&) {});
  separation_.solve(field_, 6);
  // Interpolation in a lumisphere of 2.2 degrees and its averaging: a thousandth of the range; medians alone: 0.04.
  EXPECT_LT(error(), 0.004);
  // S is zero at its 2 % quantile: the diffuse part has no constant of its own here.
  for (std::size_t texel = 0; texel < texels_.count(); ++texel)
    EXPECT_NEAR(separation_.diffuse()[texel].r, diffuse(texel), 0.01);
}

TEST_F(ReflectanceSeparationTest, OneInTwelveWrongSamplesDoNotMatter) {
  capture(400, [](std::size_t texel, int k, float& v) {
    if ((texel * 7 + static_cast<std::size_t>(k) * 5) % 12 == 0) v = 0.9F;
  });
  separation_.solve(field_, 6);
  // Of S, which is a mean, 1/12 of the difference between the wrong samples and D is left, the same for all directions.
  EXPECT_LT(error(), 0.06);
  for (std::size_t texel = 0; texel < texels_.count(); ++texel)
    EXPECT_NEAR(separation_.diffuse()[texel].r, diffuse(texel), 0.06);
}

TEST_F(ReflectanceSeparationTest, SaturatedDirectionsHaveALowerBound) {
  capture(400, [this](std::size_t texel, int k, float& v) {
    // A highlight far above saturation: all texels are clipped at 1.
    if (angle_between(lens(k, 400) - texels_.center(texel), Vec3d{-0.5, 0, 0.8}) < 0.15) v = 1.0001F;
  });
  separation_.solve(field_, 3);
  const Lumisphere& s = separation_.specular();
  const std::size_t node = s.grid.nearest({-0.5F, 0, 0.8F});
  EXPECT_EQ(s.clipped[node], 1);
  // Texels with the least D, 0.1, give the highest bound.
  EXPECT_GT(s.value[node].g, 0.7F);
  EXPECT_EQ(s.clipped[s.grid.nearest({0.5F, 0, 0.8F})], 0);
}

TEST_F(ReflectanceSeparationTest, AGapBetweenLowerBoundsIsOne) {
  Lumisphere s(20);
  for (std::size_t node = 0; node < s.grid.size(); ++node) {
    const int level = s.grid.level_of(node);
    s.weight[node] = level >= 8 && level <= 11 ? 0.0F : 1.0F;
    s.clipped[node] = s.grid.direction(node).x > 0.2 && level >= 6 && level <= 13 && s.weight[node] > 0 ? 1 : 0;
    s.value[node] = s.clipped[node] != 0 ? Radiance{2, 2, 2} : Radiance{};
  }
  fill_unseen(s);
  const std::size_t inside = s.grid.nearest({1, 0, 1}), outside = s.grid.nearest({-1, 0, 1});
  ASSERT_EQ(s.weight[inside], 0);
  EXPECT_EQ(s.clipped[inside], 1);
  // Of its neighbours, times the ratio of the Fresnel terms.
  EXPECT_NEAR(s.value[inside].g, 2, 0.5);
  EXPECT_EQ(s.clipped[outside], 0);
  EXPECT_EQ(s.value[outside].g, 0);
}

TEST_F(ReflectanceSeparationTest, WithoutLightEverythingIsZero) {
  capture(50, [](std::size_t, int, float& v) { v = 0; });
  separation_.solve(field_, 2);
  for (const TexelRadiance& d : separation_.diffuse()) EXPECT_EQ(d.r, 0);
  for (const Radiance& s : separation_.specular().value) EXPECT_EQ(s.r, 0);
}

TEST_F(ReflectanceSeparationTest, WithoutSamplesNothingIsKnown) {
  separation_.solve(field_, 2);
  for (const TexelRadiance& d : separation_.diffuse()) EXPECT_FALSE(d.seen());
  for (const Radiance& s : separation_.specular().value) EXPECT_EQ(s.r, 0);
  TexelImage image;
  separation_.predict({0, 0, 0.4}, image);
  EXPECT_FALSE(image[0].seen());
}

TEST_F(ReflectanceSeparationTest, OneViewIsItsOwnDiffusePart) {
  capture(1, [](std::size_t, int, float&) {});
  separation_.solve(field_, 3);
  TexelImage image;
  separation_.predict(lens(0, 1), image);
  for (std::size_t texel = 0; texel < image.size(); ++texel) {
    EXPECT_TRUE(std::isfinite(image[texel].r));
    EXPECT_NEAR(image[texel].r, diffuse(texel) + specular(lens(0, 1) - texels_.center(texel)), 0.02);
  }
}

TEST_F(ReflectanceSeparationTest, SharpeningUndoesTheBlurOfThePixels) {
  // Detail of four to six texels, blurred by the kernel (v/2, 1 - v, v/2) along both axes.
  constexpr double kVariance = 0.3;
  const auto detail = [](int column, int row) {
    return 0.5 + 0.2 * std::sin(1.5 * column) + 0.2 * std::cos(1.1 * row + 0.3 * column);
  };
  TexelImage image;
  for (int row = 0; row < texels_.edge; ++row)
    for (int column = 0; column < texels_.edge; ++column) {
      const double c = detail(column, row);
      const double around =
          detail(column - 1, row) + detail(column + 1, row) + detail(column, row - 1) + detail(column, row + 1);
      const auto v = static_cast<float>(c + kVariance / 2 * (around - 4 * c));
      image.push_back({v, v, v, 0});
    }
  // From above, a pixel of side p has the variance p² / 4. The error of the poses is part of the blur, 0.04 texels².
  const double pixel_m = 2 * std::sqrt(kVariance - 0.04) * texels_.texel_m();
  for (std::uint32_t k = 0; k < 9; ++k) {
    const Vec3d from{0.01 * (k % 3), 0.01 * (k / 3), 2};
    separation_.add_to_medians(image, field_.add(image, {from, pixel_m / 2}, k));
  }
  separation_.solve(field_, 2);
  TexelImage sharp;
  separation_.sharpen(kSharpenSteps, sharp);
  double before = 0, after = 0;
  for (int row = 2; row + 2 < texels_.edge; ++row)
    for (int column = 2; column + 2 < texels_.edge; ++column) {
      const auto k = static_cast<std::size_t>(row * texels_.edge + column);
      before += std::pow(static_cast<double>(separation_.diffuse()[k].r) - detail(column, row), 2);
      after += std::pow(static_cast<double>(sharp[k].r) - detail(column, row), 2);
    }
  // Each step leaves the share 1 - K of the error, which is 0.3 to 0.6 at these frequencies.
  EXPECT_LT(std::sqrt(after), 0.25 * std::sqrt(before));
}

}  // namespace
}  // namespace lightwell::specular
