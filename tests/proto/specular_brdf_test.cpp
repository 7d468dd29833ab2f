#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/specular_brdf.hpp>

#include "reference/glossy_plane.hpp"

namespace lightwell {
namespace {

namespace ref = reference;

constexpr float kInf = std::numeric_limits<float>::infinity();

ref::V3 v3(Vec3f v) { return {double{v.x}, double{v.y}, double{v.z}}; }

/// At an elevation, deg, in the plane's frame.
ref::V3 towards(double elevation_deg, double azimuth_deg) {
  const double e = elevation_deg * ref::pi / 180, a = azimuth_deg * ref::pi / 180;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

TEST(SpecularBrdf, EqualsTheReference) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int k = 0; k < 20000; ++k) {
    const double alpha = std::exp(std::log(0.005) * uniform(random));
    const auto direction = [&](bool grazing) {
      return towards(grazing ? 0.01 + 3 * uniform(random) : 90 * uniform(random), 360 * uniform(random));
    };
    const ref::V3 v = direction(k % 4 == 0);
    // Every second light is within a few lobe widths of the mirror direction.
    ref::V3 l = direction(k % 8 == 0);
    if (k % 2 == 0) {
      const auto jitter = [&] { return 6 * alpha * (uniform(random) - 0.5); };
      l = ref::normalised({-v.x + jitter(), -v.y + jitter(), v.z + jitter()});
    }
    const Vec3f vf{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
    const Vec3f lf{static_cast<float>(l.x), static_cast<float>(l.y), static_cast<float>(l.z)};
    const double expected = ref::gloss_brdf({alpha}, v3(vf), v3(lf)) * std::max(0.0F, lf.z);
    const double got = double{SpecularBrdf{static_cast<float>(alpha)}.times_cosine(vf, lf)};
    // A float's direction is off by 6e-8 rad, v + l of grazing directions by that divided by its length, and the
    // narrowest distribution changes by 2 / 0.005 a radian: 2e-4 where the sum is 0.1 long.
    EXPECT_NEAR(got, expected, 2e-3 * expected + 1e-9) << "alpha " << alpha << " v.z " << v.z << " l.z " << l.z;
  }
}

TEST(SpecularBrdf, Extremes) {
  const SpecularBrdf brdf{0.1F};
  const Vec3f pole{0, 0, 1}, across{1, 0, 0}, below{0.6F, 0, -0.8F};
  // D = 1 / (pi alpha²), F = f0, visibility 1/4.
  EXPECT_NEAR(brdf.times_cosine(pole, pole), 0.04 / (4 * ref::pi * 0.01), 1e-5);
  for (const Vec3f other : {across, below, Vec3f{0, 0, -1}, Vec3f{}}) {
    EXPECT_EQ(brdf.times_cosine(pole, other), 0);
    EXPECT_EQ(brdf.times_cosine(other, pole), 0);
    EXPECT_EQ(brdf.times_cosine(other, other), 0);
  }
  EXPECT_EQ(brdf.times_cosine({0, 0, kInf - kInf}, pole), 0) << "NaN is not above the surface";
  for (const float alpha : {0.0F, 0.001F, SpecularBrdf::kMinAlpha})
    EXPECT_EQ((SpecularBrdf{alpha}.times_cosine(pole, pole)),
              (SpecularBrdf{SpecularBrdf::kMinAlpha}.times_cosine(pole, pole)));
  const Vec3f v{std::cos(1e-4F), 0, std::sin(1e-4F)}, mirror{-v.x, 0, v.z};
  EXPECT_TRUE(std::isfinite(SpecularBrdf{0.005F}.times_cosine(v, mirror)));
}

}  // namespace
}  // namespace lightwell
