// The passes over the pixels against a double oracle that goes pixel by pixel with exact weights: blocks, and the
// coefficients that come of them, for every format, rig, response, size of block and vector unit.
#include "estimate/panorama/code_pass.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/common/row_reader.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/oracle_cases.hpp"

namespace lightwell::estimate {
namespace {

using test::Curve;
using test::OracleCase;
using test::Shot;
using test::Truth;

/// Of the largest coefficient, before the wire (proto/README.md).
constexpr double kHouse = 1e-5;
/// Of codes: the table of linear values is rounded to half of 1/65535 of full scale, and these scenes' mean is a tenth
/// of that, in pictures too small for all of it to average out. The figures measure the same at sizes that cameras
/// have.
constexpr double kCodes = 8e-5;

struct Rig {
  const char* kind;
  int width, height;
};
/// Sizes that blocks divide and sizes that they do not.
constexpr Rig kEvenRigs[] = {{"pair", 160, 120},    {"pair", 226, 170},          {"single", 98, 74},
                             {"equirect", 192, 96}, {"double_sphere", 150, 130}, {"equirect", 260, 130}};
constexpr Rig kOddRigs[] = {{"pair", 163, 121}, {"single", 97, 75}, {"equirect", 134, 67}, {"double_sphere", 129, 115}};
constexpr int kEdges[] = {1, 2, 4, 8, 16};

std::vector<Rig> rigs_for(PixelFormat format) {
  std::vector<Rig> rigs(std::begin(kEvenRigs), std::end(kEvenRigs));
  if (format == PixelFormat::rgb8 || format == PixelFormat::rgb_f32)
    rigs.insert(rigs.end(), std::begin(kOddRigs), std::end(kOddRigs));
  return rigs;
}

/// Words of raw sensors are linear; floats are radiance.
std::vector<Curve> curves_for(PixelFormat format) {
  if (format == PixelFormat::rgb_f32) return {Curve::linear};
  if (format == PixelFormat::bayer_rggb10 || format == PixelFormat::bayer_rggb12)
    return {Curve::linear, Curve::linear_black};
  return {std::begin(test::kCurves), std::end(test::kCurves)};
}

/// All that stands on one size of blocks.
struct Passes {
  const BlockLayout& layout;
  const CellGrid& grid;
  RowReader reader;
  BlockPass pixels;
  CodePass codes;

  Passes(OracleCase& c, int edge)
      : layout(c.layout(edge)),
        grid(c.grid(edge)),
        reader(c.rig(), c.table()),
        pixels(c.table(), layout),
        codes(c.rig(), c.table(), layout) {}

  BlockSums by_pixels(std::span<const Frame> bracket) {
    EXPECT_TRUE(reader.bind(bracket).ok());
    BlockSums out(layout);
    pixels.run(reader, out);
    return out;
  }
  BlockSums by_codes(std::span<const Frame> bracket) {
    EXPECT_TRUE(codes.supports(bracket));
    // What was there before must not matter.
    BlockSums out(layout);
    std::fill(out.sum.begin(), out.sum.end(), CellSum{1, 2, 3});
    out.noise = out.clipped_sr = 5;
    codes.run(bracket[0], out);
    return out;
  }
  [[nodiscard]] double deviation(const BlockSums& sums, const std::vector<reference::Rgb>& truth) const {
    Projection p;
    grid.project(sums.sum, {}, p);
    return test::deviation(p, truth);
  }
};

/// How far blocks are from the oracle's.
struct Off {
  double sum = 0;                      ///< Of the largest sum of a block.
  double peak_low = 1, peak_high = 1;  ///< Over the true peak.
  double moment = 0;                   ///< Luminance times its offset in pixels, over the largest luminance of a block.
  double noise = 1, clipped = 1;       ///< Over the true ones.
};

Off off(const BlockSums& got, const Truth& truth) {
  Off out;
  reference::Rgb largest{};
  double brightest = 0;
  for (const reference::BlockLight& b : truth.blocks) {
    for (std::size_t c = 0; c < 3; ++c) largest[c] = std::max(largest[c], b.sum[c]);
    brightest = std::max(brightest, b.luminance);
  }
  for (std::size_t i = 0; i < truth.blocks.size(); ++i) {
    const reference::BlockLight& b = truth.blocks[i];
    if (!(b.solid_angle > 0)) continue;
    const double sums[3] = {got.sum[i].r, got.sum[i].g, got.sum[i].b};
    for (std::size_t c = 0; c < 3; ++c) out.sum = std::max(out.sum, std::abs(sums[c] - b.sum[c]) / largest[c]);
    if (b.peak > 0) {
      out.peak_low = std::min(out.peak_low, got.peak[i] / b.peak);
      out.peak_high = std::max(out.peak_high, got.peak[i] / b.peak);
    }
    const double moved = std::hypot(got.offset_x[i] - b.offset.x, got.offset_y[i] - b.offset.y);
    out.moment = std::max(out.moment, moved * b.luminance / brightest);
  }
  if (truth.noise > 0) out.noise = got.noise / truth.noise;
  out.clipped = truth.clipped_sr > 0 ? got.clipped_sr / truth.clipped_sr : 1 + got.clipped_sr;
  return out;
}

/// Sums of codes are integers and the same everywhere; what is made of them is rounded with products fused or not. What
/// is not alike, and by how much; nothing where all is.
std::string unlike(const BlockSums& a, const BlockSums& b) {
  std::ostringstream out;
  const auto compare = [&](const char* what, double share, double least, auto&& of_a, auto&& of_b, std::size_t count) {
    double largest = least, apart = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = of_a(i), y = of_b(i);
      largest = std::max(largest, std::abs(x));
      apart = std::max(apart, std::abs(x - y));
    }
    if (!(apart <= share * largest)) out << what << " by " << apart << " of " << largest << "; ";
  };
  const auto numbers = [&](const char* what, double share, double least, const std::vector<float>& x,
                           const std::vector<float>& y) {
    compare(
        what, share, least, [&](std::size_t i) { return x[i]; }, [&](std::size_t i) { return y[i]; }, x.size());
  };
  const auto colors = [&](const char* what, float CellSum::*c) {
    compare(
        what, 1e-6, 0, [&](std::size_t i) { return a.sum[i].*c; }, [&](std::size_t i) { return b.sum[i].*c; },
        a.sum.size());
  };
  const auto total = [&](const char* what, double share, double x, double y) {
    compare(
        what, share, 0, [&](std::size_t) { return x; }, [&](std::size_t) { return y; }, 1);
  };
  colors("red", &CellSum::r);
  colors("green", &CellSum::g);
  colors("blue", &CellSum::b);
  numbers("peak", 1e-6, 0, a.peak, b.peak);
  numbers("clipped", 1e-6, 0, a.clipped, b.clipped);
  // Places are differences of two within a block of up to 16 pixels; a nearly dark block divides them by little.
  numbers("offset_x", 1e-5, 16, a.offset_x, b.offset_x);
  numbers("offset_y", 1e-5, 16, a.offset_y, b.offset_y);
  total("clipped_sr", 1e-6, a.clipped_sr, b.clipped_sr);
  // A mean that is rounded the other way may count as the next code's, whose step is another.
  total("noise", 1e-4, a.noise, b.noise);
  total("bias", 1e-4, a.bias, b.bias);
  return out.str();
}

class EveryFormat : public testing::TestWithParam<PixelFormat> {
 protected:
  /// Calls check(case) for each rig and response.
  template <class Check>
  void for_cases(Check&& check) {
    for (const Rig& rig : rigs_for(GetParam())) {
      OracleCase c(rig.kind, rig.width, rig.height, GetParam(), Curve::as_it_comes);
      for (const Curve curve : curves_for(GetParam())) {
        c.set_curve(curve);
        const testing::ScopedTrace rig_trace(
            __FILE__, __LINE__,
            testing::Message() << rig.kind << " " << rig.width << "x" << rig.height << ", " << test::to_string(curve));
        check(c);
      }
    }
  }
};

TEST_P(EveryFormat, PixelByPixelGivesTheCoefficientsOfTheOracleToTheHousePrecision) {
  const double one[] = {1};
  unsigned seed = 100;
  for_cases([&](OracleCase& c) {
    const reference::RandomScene scene(++seed);
    const Shot shot = c.shoot(scene, one, 0.95, seed % 3);
    for (const int edge : kEdges) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      const BlockSums sums = passes.by_pixels(shot.frames);
      const Truth truth = c.truth(shot.frames, edge);
      const std::vector<reference::Rgb> coefficients = c.coefficients(truth, edge);
      test::on_each_target(
          [&](const char* target) { EXPECT_LT(passes.deviation(sums, coefficients), kHouse) << target; });
      // Floats: 2^-24 times the root of some hundred additions.
      const Off o = off(sums, truth);
      EXPECT_LT(o.sum, 1e-6);
      EXPECT_NEAR(o.peak_low, 1, 1e-6);
      EXPECT_NEAR(o.peak_high, 1, 1e-6);
      EXPECT_LT(o.moment, 2e-5) << "differences of two places in a block of 16, each to 2^-20 of a pixel";
      EXPECT_NEAR(o.noise, 1, 1e-5);
      EXPECT_EQ(sums.clipped_sr, 0);
    }
  });
}

TEST_P(EveryFormat, ABracketGivesTheCoefficientsOfTheOracleToTheHousePrecision) {
  const double exposures[] = {8, 1, 0.15};
  unsigned seed = 200;
  for_cases([&](OracleCase& c) {
    const reference::RandomScene scene(++seed);
    const Shot shot = c.shoot(scene, exposures, 1.5, seed % 2);
    for (const int edge : {2, 16}) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      EXPECT_FALSE(passes.codes.supports(shot.frames));
      const BlockSums sums = passes.by_pixels(shot.frames);
      const Truth truth = c.truth(shot.frames, edge);
      const std::vector<reference::Rgb> coefficients = c.coefficients(truth, edge);
      test::on_each_target(
          [&](const char* target) { EXPECT_LT(passes.deviation(sums, coefficients), kHouse) << target; });
      const Off o = off(sums, truth);
      EXPECT_LT(o.sum, 2e-6) << "weights of three exposures are divided too";
      EXPECT_NEAR(o.peak_low, 1, 2e-6);
      EXPECT_NEAR(o.peak_high, 1, 2e-6);
      if (GetParam() != PixelFormat::rgb_f32) {
        EXPECT_NEAR(o.noise, 1, 1e-5);
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Passes, EveryFormat, testing::ValuesIn(kPixelFormats),
                         [](const auto& p) { return std::string(to_string(p.param)); });

class EveryCodeFormat : public EveryFormat {};

TEST_P(EveryCodeFormat, SumsOfCodesGiveTheCoefficientsOfTheOracle) {
  const double one[] = {1};
  unsigned seed = 300;
  for_cases([&](OracleCase& c) {
    const reference::RandomScene scene(++seed);
    const Shot shot = c.shoot(scene, one, 0.95, seed % 3);
    for (const int edge : {2, 4, 8, 16}) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      const Truth truth = c.truth(shot.frames, edge);
      const std::vector<reference::Rgb> coefficients = c.coefficients(truth, edge);
      std::optional<BlockSums> first;
      test::on_each_target([&](const char* target) {
        const BlockSums sums = passes.by_codes(shot.frames);
        EXPECT_LT(passes.deviation(sums, coefficients), kCodes) << target;
        if (!first) first = sums;
        EXPECT_EQ(unlike(sums, *first), "") << target;
      });
      const Off o = off(*first, truth);
      EXPECT_LT(o.sum, 4e-3) << "weights at the rim, to 1/255 of a block's largest";
      // One vignetting for all of a block; the largest of each channel, whichever pixel has it; and of two greens the
      // larger, twice their mean where the other lies outside the lens.
      EXPECT_GT(o.peak_low, 0.9);
      EXPECT_LT(o.peak_high, is_bayer(GetParam()) ? 2.5 : 1.2);
      // All pixels of a block alike: the mean square of weights counts as the square of their mean.
      EXPECT_GT(o.noise, 0.95);
      EXPECT_LT(o.noise, 1.01);
      EXPECT_EQ(first->clipped_sr, 0);
    }
  });
}

TEST_P(EveryCodeFormat, WhatIsSaturatedIsCountedByItsSolidAngle) {
  const double one[] = {1};
  unsigned seed = 400;
  for_cases([&](OracleCase& c) {
    const reference::RandomScene scene(++seed);
    const Shot shot = c.shoot(scene, one, 3);
    for (const int edge : {2, 8, 16}) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      const Truth truth = c.truth(shot.frames, edge);
      ASSERT_GT(truth.clipped_sr, 0);
      EXPECT_NEAR(off(passes.by_pixels(shot.frames), truth).clipped, 1, 1e-5);
      // All pixels of a block count alike, and of its channels the one that saturates most: at a rim, near the poles of
      // a stitched picture, and where it is now red and now blue.
      const double counted = off(passes.by_codes(shot.frames), truth).clipped;
      EXPECT_GT(counted, 0.85);
      EXPECT_LT(counted, 1.35);
    }
  });
}

TEST_P(EveryCodeFormat, BytesThatMeanNothingAreSummedAlikeOnEveryVectorUnit) {
  unsigned seed = 500;
  for_cases([&](OracleCase& c) {
    const Shot shot = c.shoot_noise(++seed);
    for (const int edge : {2, 4, 8, 16}) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      std::optional<BlockSums> first;
      test::on_each_target([&](const char* target) {
        const BlockSums sums = passes.by_codes(shot.frames);
        if (!first) first = sums;
        EXPECT_EQ(unlike(sums, *first), "") << target;
      });
      const Truth truth = c.truth(shot.frames, edge);
      const Off o = off(*first, truth);
      EXPECT_LT(o.sum, 5e-3);
      EXPECT_GT(o.peak_low, 0.9) << "a peak is not overlooked";
      EXPECT_GT(o.noise, 0.8);
      EXPECT_LT(o.noise, 1.2);
    }
  });
}

TEST_P(EveryCodeFormat, ALampInTheCornerOfABlockIsFoundThere) {
  // Moments in pixels times luminance: what stands beside the middle of its block is moved by them, or counted.
  OracleCase c("pair", 226, 170, GetParam(), curves_for(GetParam()).front());
  reference::RandomScene scene(7, 0);
  for (int k = 0; k < 12; ++k) {
    const double a = 2.4 * k, z = 1 - (2 * k + 1) / 12.0, r = std::sqrt(1 - z * z);
    scene.lamps.push_back({{r * std::cos(a), r * std::sin(a), z}, 0.03, {30, 30, 30}});
  }
  const double one[] = {1};
  const Shot shot = c.shoot(scene, one);
  for (const int edge : {4, 8, 16}) {
    Passes passes(c, edge);
    const Truth truth = c.truth(shot.frames, edge);
    const BlockSums sums = passes.by_codes(shot.frames);
    double largest = 0;
    for (const reference::BlockLight& b : truth.blocks) largest = std::max(largest, std::hypot(b.offset.x, b.offset.y));
    EXPECT_GT(largest, 0.2 * edge) << "the scene asks for it";
    // Of the largest luminance: solid angle and vignetting across a block of 16 differ by percents, a photosite of a
    // mosaic stands for the middle of its quad.
    EXPECT_LT(off(sums, truth).moment, 0.15) << edge;
  }
}

TEST_P(EveryCodeFormat, ARigIsReadPixelByPixelWhereThePassOfCodesDoesNotReach) {
  const double one[] = {1}, three[] = {1, 0.5, 0.25};
  OracleCase wide("pair", 66, 64, GetParam(), curves_for(GetParam()).front());
  OracleCase narrow("pair", 62, 64, GetParam(), curves_for(GetParam()).front());
  const reference::RandomScene scene(1);
  EXPECT_TRUE(Passes(wide, 8).codes.supports(wide.shoot(scene, one).frames));
  EXPECT_FALSE(Passes(wide, 8).codes.supports(wide.shoot(scene, three).frames)) << "a bracket";
  EXPECT_FALSE(Passes(wide, 1).codes.supports(wide.shoot(scene, one).frames)) << "blocks of one pixel";
  EXPECT_FALSE(Passes(narrow, 8).codes.supports(narrow.shoot(scene, one).frames)) << "narrower than a vector";
}

INSTANTIATE_TEST_SUITE_P(CodePass, EveryCodeFormat,
                         testing::Values(PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv,
                                         PixelFormat::bayer_rggb8, PixelFormat::bayer_rggb10,
                                         PixelFormat::bayer_rggb12),
                         [](const auto& p) { return std::string(to_string(p.param)); });

}  // namespace
}  // namespace lightwell::estimate
