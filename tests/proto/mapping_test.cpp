#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <lightwell/environment.hpp>
#include <lightwell/equirect.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/pixel.hpp>

#include "reference/panorama.hpp"
#include "reference/vector.hpp"

namespace lightwell {
namespace {

namespace ref = reference;

// Written by hand from proto/README.md: the centre is -Z, to the right is +X, the top row is +Y.
TEST(Equirect, LooksAlongMinusZWithXToTheRight) {
  const Vec3d centre = equirect_direction(0.5, 0.5), right = equirect_direction(0.75, 0.5),
              top = equirect_direction(0.3, 0);
  EXPECT_NEAR(centre.z, -1, 1e-12);
  EXPECT_NEAR(right.x, 1, 1e-12);
  EXPECT_NEAR(top.y, 1, 1e-12);
}

TEST(Equirect, MatchesTheOracle) {
  for (int j = 0; j < 16; ++j) {
    EXPECT_NEAR(equirect_solid_angle(j, 32, 16), ref::pixel_solid_angle(j, 32, 16), 1e-15);
    for (int i = 0; i < 32; ++i) {
      const Vec3d d = equirect_direction((i + 0.5) / 32, (j + 0.5) / 16);
      const ref::V3 truth = ref::pixel_direction(i, j, 32, 16);
      EXPECT_NEAR(d.x, truth.x, 1e-14);
      EXPECT_NEAR(d.y, truth.y, 1e-14);
      EXPECT_NEAR(d.z, truth.z, 1e-14);
    }
  }
}

TEST(Equirect, RoundTrips) {
  for (const ref::V3& p : ref::fibonacci_normals(500)) {
    const EquirectUv uv = equirect_uv({p.x, p.y, p.z});
    ASSERT_GE(uv.u, 0);
    ASSERT_LT(uv.u, 1);
    const Vec3d d = equirect_direction(uv.u, uv.v);
    EXPECT_NEAR(length(d - Vec3d{p.x, p.y, p.z}), 0, 1e-12);
  }
}

TEST(FibonacciLattice, MatchesTheOracle) {
  const std::vector<ref::V3> truth = ref::fibonacci_normals(500);
  for (int i = 0; i < 500; ++i) {
    const ref::V3& t = truth[static_cast<std::size_t>(i)];
    EXPECT_NEAR(length(fibonacci_direction(i, 500) - Vec3d{t.x, t.y, t.z}), 0, 1e-12) << i;
  }
}

TEST(Octahedral, RoundTripsIncludingPolesAndFolds) {
  std::vector<Vec3f> all = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}};
  for (const ref::V3& p : ref::fibonacci_normals(500)) all.push_back(vec_cast<float>(Vec3d{p.x, p.y, p.z}));
  for (const Vec3f& d : all) {
    const OctUv uv = oct_encode(d);
    ASSERT_TRUE(uv.u >= 0 && uv.u <= 1 && uv.v >= 0 && uv.v <= 1);
    EXPECT_NEAR(length(oct_decode(uv) - d), 0, 1e-6);
  }
}

TEST(Rgb9e5, HoldsNineBitsOverThirtyOneOctaves) {
  for (float v = 1e-4F; v < 6e4F; v *= 1.7F) {
    const auto back = rgb9e5_decode(rgb9e5_encode(v, v / 2, v / 3));
    // Half of the last of nine bits of the largest channel.
    EXPECT_NEAR(back[0], v, v / 511) << v;
    EXPECT_NEAR(back[1], v / 2, v / 511) << v;
  }
}

TEST(Rgb9e5, RoundsAsTheSpecificationDoes) {
  // OpenGL 4.6, 8.5.2, eq. 8.4 and following, for one channel.
  for (float v = 1e-12F; v < 6.5e4F; v *= 1.00037F) {
    int exponent = std::max(-16, static_cast<int>(std::floor(std::log2(static_cast<double>(v))))) + 16;
    if (std::floor(std::ldexp(static_cast<double>(v), 24 - exponent) + 0.5) >= 512) ++exponent;
    const auto mantissa =
        static_cast<std::uint32_t>(std::floor(std::ldexp(static_cast<double>(v), 24 - exponent) + 0.5));
    const std::uint32_t code = rgb9e5_encode(0, v, 0);
    EXPECT_EQ(code >> 9 & 511U, mantissa) << v;
    EXPECT_EQ(code >> 27, static_cast<std::uint32_t>(exponent)) << v;
    EXPECT_EQ(rgb9e5_decode(code)[1], std::ldexp(static_cast<float>(mantissa), exponent - 24)) << v;
  }
}

TEST(Rgb9e5, InvalidValuesBecomeZeroAndTooLargeOnesAreClamped) {
  EXPECT_EQ(rgb9e5_encode(std::numeric_limits<float>::quiet_NaN(), -1, 0), 0U);
  EXPECT_NEAR(rgb9e5_decode(rgb9e5_encode(1e9F, 0, 0))[0], 65408, 1);
}

TEST(Ycbcr, HasWhiteBlackAndThePrimariesOfBt601LimitedRange) {
  const auto white = rgb8_of_ycbcr601(235, 128, 128), black = rgb8_of_ycbcr601(16, 128, 128),
             red = rgb8_of_ycbcr601(81, 90, 240);
  for (const int v : white) EXPECT_EQ(v, 255);
  for (const int v : black) EXPECT_EQ(v, 0);
  // Tolerance: inputs are rounded to bytes, and a step of chroma is two codes.
  EXPECT_NEAR(red[0], 255, 2);
  EXPECT_NEAR(red[1], 0, 2);
  EXPECT_NEAR(red[2], 0, 2);
}

TEST(Ycbcr, IsWithinOneCodeOfTheExactConversion) {
  double worst = 0;
  for (int y = 0; y < 256; y += 3)
    for (int cb = 0; cb < 256; cb += 5)
      for (int cr = 0; cr < 256; cr += 5) {
        const double l = 255.0 / 219 * (y - 16);
        const double exact[3] = {l + 1.596027 * (cr - 128), l - 0.391762 * (cb - 128) - 0.812968 * (cr - 128),
                                 l + 2.017232 * (cb - 128)};
        const auto codes = rgb8_of_ycbcr601(y, cb, cr);
        for (std::size_t k = 0; k < 3; ++k)
          worst = std::max(worst, std::abs(codes[k] - std::clamp(exact[k], 0.0, 255.0)));
      }
  // Half a code of rounding, and 1/64 of each product.
  EXPECT_LT(worst, 0.55);
}

TEST(Srgb, RoundTrips) {
  for (int i = 0; i <= 255; ++i) EXPECT_NEAR(linear_to_srgb(srgb_to_linear(i / 255.0)), i / 255.0, 1e-12);
}

}  // namespace
}  // namespace lightwell
