// Extreme inputs: zero, infinite and NaN values, seams, single pixels, very many frames, equal values.
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include <lightwell/codec.hpp>

#include "scenes.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

RigParameters rig() { return rig_of("pair", 160, 120); }

/// Expects that the descriptor can be encoded, which excludes NaN.
void expect_sane(const Descriptor& d) {
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
}

TEST(Extremes, ScaleWithRadianceOverSixteenDecades) {
  const auto estimator = estimator_of(rig());
  const Descriptor one = estimated(*estimator, picture_of(rig(), lamp({0.4, 0.3, -0.8}, 0.07, 300)));
  for (const float scale : {1e-8F, 1e-4F, 1e4F, 1e8F}) {
    const Descriptor d = estimated(*estimator, picture_of(rig(), [&](Vec3d p) {
      return lamp({0.4, 0.3, -0.8}, 0.07, 300)(p) * scale;
    }));
    ASSERT_EQ(d.lights.size(), one.lights.size());
    for (std::size_t i = 0; i < 25; ++i)
      EXPECT_NEAR(d.radiance.c[i].r / scale, one.radiance.c[i].r, 1e-5 * std::abs(one.radiance.c[0].r));
    EXPECT_NEAR(d.lights[0].irradiance.g / scale, one.lights[0].irradiance.g, 1e-5 * one.lights[0].irradiance.g);
    EXPECT_NEAR(d.bound.truncation, one.bound.truncation, 1e-5);
    // The quantization step is a power of two: its part may change by a factor of two with the scale.
    EXPECT_NEAR(d.bound.total, one.bound.total, one.bound.quantization);
    expect_sane(d);
  }
}

TEST(Extremes, AllBlackIsFlaggedDark) {
  const Descriptor d = estimated(rig(), [](Vec3d) { return Radiance{}; });
  EXPECT_TRUE(d.flags.has(Flag::dark));
  EXPECT_TRUE(std::isinf(d.bound.total));
  EXPECT_TRUE(d.lights.empty());
  expect_sane(d);
}

TEST(Extremes, OneHotPixelIsOneLight) {
  const auto r = rig();
  Picture p = picture_of(r, [](Vec3d) { return Radiance{1, 1, 1}; });
  const std::size_t at = 3 * (60 * 160 + 80);
  for (std::size_t k = 0; k < 3; ++k) p.pixels[0][at + k] = 1e6F;
  const Descriptor d = estimated(*estimator_of(r), p);
  ASSERT_EQ(d.lights.size(), 1U);
  EXPECT_LT(degrees_between(d.lights[0].direction, {0, 0, -1}), 1.3) << "within a pixel of 1.2 degrees";
  expect_sane(d);
}

TEST(Extremes, InvalidPixelsAreReplacedAndFlagged) {
  const auto r = rig();
  const auto estimator = estimator_of(r);
  const Descriptor clean = estimated(*estimator, picture_of(r, [](Vec3d) { return Radiance{1, 1, 1}; }));
  for (const float bad : {kNan, kInf, -kInf, -1000.0F, -1e-20F}) {
    for (const int extent : {1, 160, 160 * 120}) {
      Picture p = picture_of(r, [](Vec3d) { return Radiance{1, 1, 1}; });
      const std::size_t first = extent == 160 * 120 ? 0 : 60 * 160 + (extent == 1 ? 80 : 0);
      for (std::size_t i = first; i < first + static_cast<std::size_t>(extent); ++i) p.pixels[0][3 * i + 1] = bad;
      const Descriptor d = estimated(*estimator, p);
      EXPECT_TRUE(d.flags.has(Flag::cleaned)) << bad << " " << extent;
      EXPECT_EQ(d.flags.has(Flag::clipped), bad == kInf) << bad << " " << extent;
      expect_sane(d);
      if (extent == 1 && bad != kInf) {
        EXPECT_NEAR(d.radiance.c[0].g, clean.radiance.c[0].g, 1e-3);
      }
    }
  }
  EXPECT_FALSE(estimated(*estimator, picture_of(r,
                                                [](Vec3d) {
                                                  return Radiance{1, 1, 1};
                                                }))
                   .flags.any())
      << "the next frame must not be flagged";
}

TEST(Extremes, SunIsEqualOnPoleSeamEdgeAndBetweenLenses) {
  const auto r = rig_of("pair", 640, 480);
  const auto estimator = estimator_of(r);
  float first = 0;
  for (const Vec3d& at : {Vec3d{0, 1, 0}, Vec3d{0, -1, 0}, Vec3d{1, 0, 0}, Vec3d{-1, 0, 0}, Vec3d{1, 0, 0.08},
                          Vec3d{0.2, 1, -0.05}, Vec3d{0, 0, -1}, Vec3d{0, 0, 1}}) {
    const Vec3d axis = normalized(at);
    // A disc of 0.5 degrees at 1e5 times the rest, blurred as by a lens.
    const Descriptor d = estimated(*estimator, picture_of(r, [&](Vec3d p) {
      const double a = angle_between(p, axis);
      const auto l = static_cast<float>(1e5 * std::exp(-a * a / (2 * 0.008 * 0.008)));
      return Radiance{1 + l, 1 + l, 1 + l};
    }));
    ASSERT_GE(d.lights.size(), 1U);
    EXPECT_LT(degrees_between(d.lights[0].direction, axis), 0.1) << at.x << " " << at.y << " " << at.z;
    if (first == 0) first = d.lights[0].irradiance.g;
    // Sampled at the middles of pixels, the energy of the blurred disc varies by a few tenths of a percent.
    EXPECT_NEAR(d.lights[0].irradiance.g / first, 1, 0.01) << at.x << " " << at.y << " " << at.z;
  }
}

TEST(Extremes, AThousandLampsGiveAValidDescriptor) {
  std::vector<Vec3d> lamps;
  for (const reference::V3& n : reference::fibonacci_normals(1000)) lamps.push_back({n.x, n.y, n.z});
  const auto r = rig_of("pair", 320, 240);
  const Descriptor d = estimated(r, [&](Vec3d p) {
    float l = 0;
    for (const Vec3d& lamp_at : lamps)
      if (dot(p, lamp_at) > std::cos(0.01)) l = 500;
    return Radiance{1 + l, 1 + l, 1 + l};
  });
  EXPECT_LE(d.lights.size(), 8U);
  expect_sane(d);
}

TEST(Extremes, TwoApproachingLampsAreNeverLost) {
  const auto r = rig_of("pair", 320, 240);
  const auto estimator = estimator_of(r);
  for (double gap = 20; gap >= 0; gap -= 1) {
    const double half = gap / 2 * 3.14159265 / 180;
    const Vec3d a{std::sin(half), 0.2, -std::cos(half)}, b{-std::sin(half), 0.2, -std::cos(half)};
    const Descriptor d = estimated(*estimator, picture_of(r, [&](Vec3d p) {
      float l = 0;
      for (const Vec3d& axis : {normalized(a), normalized(b)}) {
        const double angle = angle_between(p, axis);
        l += static_cast<float>(2000 * std::exp(-angle * angle / (2 * 0.012 * 0.012)));
      }
      return Radiance{1 + l, 1 + l, 1 + l};
    }));
    ASSERT_FALSE(d.lights.empty()) << gap;
    float sum = 0;
    for (const Light& l : d.lights) sum += l.irradiance.g;
    const double one = 2000 * 2 * 3.14159265 * 0.012 * 0.012;
    EXPECT_NEAR(sum / (2 * one), 1, 0.06) << "energy at " << gap << " degrees";
    if (gap >= 8) {
      EXPECT_EQ(d.lights.size(), 2U) << gap;
    }
  }
}

TEST(Extremes, OddAndTinySizesWork) {
  for (const auto& [w, h] : {std::pair{16, 16}, {17, 23}, {61, 47}, {33, 16}}) {
    const Descriptor d = estimated(rig_of("pair", w, h), [](Vec3d) { return Radiance{1, 1, 1}; });
    EXPECT_NEAR(d.radiance.c[0].r, 3.5449, 0.4) << w << "x" << h;
    expect_sane(d);
  }
  RigParameters one;
  one.lenses.push_back({1, 1, EquirectangularParameters{}, 3.14159265, {upright_lens_cv(), {}}, {}});
  expect_sane(estimated(one, [](Vec3d) { return Radiance{1, 1, 1}; }));
}

TEST(Extremes, TinyImagesAreWithinTheirBound) {
  for (const int width : {16, 24, 32, 48}) {
    const Descriptor d = estimated(rig_of("equirect", width, width / 2), [](Vec3d p) {
      return Radiance{p.y > 0 ? 2.0F : 1.0F, 1, 1};
    });
    const double error = error_of(d, [](Vec3d n) {
      // Irradiance of a hemisphere of radiance 1: pi (1 + cos) / 2.
      const auto pi = std::numbers::pi_v<float>;
      return Irradiance{pi + pi * (1 + static_cast<float>(n.y)) / 2, pi, pi};
    });
    EXPECT_LE(error, d.bound.total) << width;
    EXPECT_LT(error, 0.1) << width;
  }
}

TEST(Extremes, BoundIncludesLinesFinerThanABlock) {
  for (int row = 84; row < 88; ++row) {
    for (const bool along : {true, false}) {
      const auto r = rig_of("equirect", 512, 256);
      Picture p = picture_of(r, [](Vec3d) { return Radiance{0.1F, 0.1F, 0.1F}; });
      for (std::size_t i = 0; i < (along ? 512U : 256U); ++i)
        for (std::size_t k = 0; k < 6; ++k) {
          const auto j = static_cast<std::size_t>(row);
          (along ? p.pixels[0][3 * ((j + k / 3) * 512 + i) + k % 3] : p.pixels[0][3 * (i * 512 + j) + k]) = 6;
        }
      const Descriptor d = estimated(*estimator_of(r), p);
      std::vector<reference::Rgb> got;
      const auto normals = reference::fibonacci_normals(2048);
      for (const reference::V3& n : normals) {
        const Irradiance e = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
        got.push_back({e.r, e.g, e.b});
      }
      const reference::Panorama world{512, 256, {p.pixels[0].begin(), p.pixels[0].end()}};
      const auto error = reference::irradiance_error(reference::irradiance_at(world, normals), got);
      EXPECT_LE(std::max(error.rms, error.luminance_weighted), d.bound.total) << row << " " << along;
    }
  }
}

TEST(Extremes, RandomPicturesNeverGiveNan) {
  const auto r = rig_of("pair", 64, 48);
  const auto estimator = estimator_of(r);
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    Picture p = picture_of(r, [](Vec3d) { return Radiance{}; });
    for (auto& lens : p.pixels)
      for (float& v : lens) {
        const auto bits = static_cast<std::uint32_t>(random());
        // Sometimes an arbitrary float, otherwise radiance over twelve decades.
        if (bits % 16 == 0)
          std::memcpy(&v, &bits, sizeof v);
        else
          v = std::pow(10.0F, static_cast<float>(bits % 1200) / 100 - 6);
      }
    Descriptor d;
    const Status s = estimator->estimate(std::span(&p.frame, 1), d);
    Encoder encoder;
    // Floats near the end of their range may overflow a sum: encoding then fails, and nothing is published.
    if (s.ok() && !encoder.encode(d).ok()) {
      bool huge = false;
      for (auto& lens : p.pixels)
        for (const float v : lens) huge |= v > 1e30F;
      EXPECT_TRUE(huge);
    }
  }
}

TEST(Extremes, ManyFramesDoNotDrift) {
  const auto r = rig_of("pair", 64, 48);
  const auto estimator = estimator_of(r);
  const Picture p = picture_of(r, lamp({1, 1, -1}, 0.1, 200));
  const Descriptor first = estimated(*estimator, p);
  Descriptor d;
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(estimator->estimate(std::span(&p.frame, 1), d).ok());
  EXPECT_EQ(d, first);
}

}  // namespace
}  // namespace lightwell
