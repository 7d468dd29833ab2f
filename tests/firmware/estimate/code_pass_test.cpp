// Compares BlockPass and CodePass with a double-precision oracle that uses exact weights per pixel: block sums and SH
// coefficients, for every format, rig, response, block size and Highway target.
#include "estimate/panorama/code_pass.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/frames/row_reader.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/oracle_cases.hpp"
#include "firmware/estimate/parts_of_picture.hpp"

namespace lightwell::estimate {
namespace {

using test::Curve;
using test::OracleCase;
using test::Shot;
using test::Truth;

/// Required precision before encoding, relative to the largest coefficient (proto/README.md).
constexpr double kPrecision = 1e-5;
/// The same for CodePass: its table of linear values is rounded to half of 1/65535 of full scale, the mean of these
/// scenes is a tenth of full scale, and the images are too small for all rounding errors to average out. The figures
/// measure the same at the sizes of cameras.
constexpr double kCodePrecision = 8e-5;

struct Rig {
  const char* kind;
  int width, height;
};
/// Sizes that are multiples of the block size, and others.
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

/// Responses to test: words of raw sensors are linear, floats are radiance.
std::vector<Curve> curves_for(PixelFormat format) {
  if (format == PixelFormat::rgb_f32) return {Curve::linear};
  if (format == PixelFormat::bayer_rggb10 || format == PixelFormat::bayer_rggb12)
    return {Curve::linear, Curve::linear_black};
  return {std::begin(test::kCurves), std::end(test::kCurves)};
}

/// Layout, grid, reader and passes for one block size.
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

  BlockSums run_block_pass(std::span<const Frame> bracket) {
    EXPECT_TRUE(reader.bind(bracket).ok());
    BlockSums out(layout);
    pixels.run(reader, out);
    return out;
  }
  BlockSums run_code_pass(std::span<const Frame> bracket) {
    EXPECT_TRUE(codes.supports(bracket));
    // Previous content must not matter.
    BlockSums out(layout);
    std::fill(out.sum.begin(), out.sum.end(), CellSum{1, 2, 3});
    out.noise = out.clipped_sr = 5;
    codes.run(bracket[0], {}, {}, out);
    return out;
  }
  [[nodiscard]] double deviation(const BlockSums& sums, const std::vector<reference::Rgb>& truth) const {
    Projection p;
    grid.project(sums.sum, {}, p);
    return test::deviation(p, truth);
  }
};

/// Deviations of block sums from the oracle's.
struct Deviations {
  double sum = 0;                      ///< Relative to the largest sum of a block.
  double peak_low = 1, peak_high = 1;  ///< Smallest and largest ratio to the true peak.
  double moment = 0;              ///< Luminance times offset (pixels), relative to the largest luminance of a block.
  double noise = 1, clipped = 1;  ///< Ratios to the true values.
};

Deviations deviations(const BlockSums& got, const Truth& truth) {
  Deviations out;
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
    const double distance = std::hypot(got.offset_x[i] - b.offset.x, got.offset_y[i] - b.offset.y);
    out.moment = std::max(out.moment, distance * b.luminance / brightest);
  }
  if (truth.noise > 0) out.noise = got.noise / truth.noise;
  out.clipped = truth.clipped_sr > 0 ? got.clipped_sr / truth.clipped_sr : 1 + got.clipped_sr;
  return out;
}

/// Describes the differences between the results of two targets that exceed rounding; empty where there are none. Sums
/// of codes are integers and equal on all targets; later computations may use fused multiply-add or not.
std::string find_difference(const BlockSums& a, const BlockSums& b) {
  std::ostringstream out;
  const auto compare = [&](const char* what, double share, double least, auto&& of_a, auto&& of_b, std::size_t count) {
    double largest = least, difference = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = of_a(i), y = of_b(i);
      largest = std::max(largest, std::abs(x));
      difference = std::max(difference, std::abs(x - y));
    }
    if (!(difference <= share * largest)) out << what << " by " << difference << " of " << largest << "; ";
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
  // Offsets are differences of positions within a block of up to 16 pixels, divided by the luminance of the block.
  numbers("offset_x", 1e-5, 16, a.offset_x, b.offset_x);
  numbers("offset_y", 1e-5, 16, a.offset_y, b.offset_y);
  total("clipped_sr", 1e-6, a.clipped_sr, b.clipped_sr);
  // A mean that is rounded differently may select the step of the next code.
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

TEST_P(EveryFormat, BlockPassEqualsTheOracle) {
  const double one[] = {1};
  unsigned seed = 100;
  for_cases([&](OracleCase& c) {
    const reference::RandomScene scene(++seed);
    const Shot shot = c.shoot(scene, one, 0.95, seed % 3);
    for (const int edge : kEdges) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      const BlockSums sums = passes.run_block_pass(shot.frames);
      const Truth truth = c.truth(shot.frames, edge);
      const std::vector<reference::Rgb> coefficients = c.coefficients(truth, edge);
      test::on_each_target(
          [&](const char* target) { EXPECT_LT(passes.deviation(sums, coefficients), kPrecision) << target; });
      // Float rounding: 2^-24 times the square root of some hundred additions.
      const Deviations o = deviations(sums, truth);
      EXPECT_LT(o.sum, 1e-6);
      EXPECT_NEAR(o.peak_low, 1, 1e-6);
      EXPECT_NEAR(o.peak_high, 1, 1e-6);
      EXPECT_LT(o.moment, 2e-5) << "tolerance: differences of positions in a block of 16, each to 2^-20 pixels";
      EXPECT_NEAR(o.noise, 1, 1e-5);
      EXPECT_EQ(sums.clipped_sr, 0);
    }
  });
}

TEST_P(EveryFormat, BlockPassOfABracketEqualsTheOracle) {
  const double exposures[] = {8, 1, 0.15};
  unsigned seed = 200;
  for_cases([&](OracleCase& c) {
    const reference::RandomScene scene(++seed);
    const Shot shot = c.shoot(scene, exposures, 1.5, seed % 2);
    for (const int edge : {2, 16}) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      EXPECT_FALSE(passes.codes.supports(shot.frames));
      const BlockSums sums = passes.run_block_pass(shot.frames);
      const Truth truth = c.truth(shot.frames, edge);
      const std::vector<reference::Rgb> coefficients = c.coefficients(truth, edge);
      test::on_each_target(
          [&](const char* target) { EXPECT_LT(passes.deviation(sums, coefficients), kPrecision) << target; });
      const Deviations o = deviations(sums, truth);
      EXPECT_LT(o.sum, 2e-6) << "tolerance: also rounding of the weights of three exposures";
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

TEST_P(EveryCodeFormat, CodePassEqualsTheOracle) {
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
        const BlockSums sums = passes.run_code_pass(shot.frames);
        EXPECT_LT(passes.deviation(sums, coefficients), kCodePrecision) << target;
        if (!first) first = sums;
        EXPECT_EQ(find_difference(sums, *first), "") << target;
        EXPECT_EQ(test::difference_of_parts(passes.codes, shot.frames[0], sums, passes.layout), "") << target;
      });
      const Deviations o = deviations(*first, truth);
      EXPECT_LT(o.sum, 4e-3) << "tolerance: weights at the edge are rounded to 1/255 of the block's largest";
      // The peak uses one vignetting value per block, the maximum of each channel in any pixel, and the larger of two
      // greens, which is twice their mean where the other is outside of the image circle.
      EXPECT_GT(o.peak_low, 0.9);
      EXPECT_LT(o.peak_high, is_bayer(GetParam()) ? 2.5 : 1.2);
      // Noise assumes equal weights in a block: their mean square is approximated by their squared mean.
      EXPECT_GT(o.noise, 0.95);
      EXPECT_LT(o.noise, 1.01);
      EXPECT_EQ(first->clipped_sr, 0);
    }
  });
}

TEST_P(EveryCodeFormat, SaturatedSolidAngleIsCounted) {
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
      EXPECT_NEAR(deviations(passes.run_block_pass(shot.frames), truth).clipped, 1, 1e-5);
      // All pixels of a block count equally, and the channel with most saturated pixels is used: this is inexact at the
      // edge of a lens, near the poles of an equirectangular image, and where different channels saturate.
      const double counted = deviations(passes.run_code_pass(shot.frames), truth).clipped;
      EXPECT_GT(counted, 0.85);
      EXPECT_LT(counted, 1.35);
    }
  });
}

TEST_P(EveryCodeFormat, RandomBytesGiveEqualSumsOnEveryTarget) {
  unsigned seed = 500;
  for_cases([&](OracleCase& c) {
    const Shot shot = c.shoot_random_bytes(++seed);
    for (const int edge : {2, 4, 8, 16}) {
      SCOPED_TRACE(testing::Message() << "blocks of " << edge);
      Passes passes(c, edge);
      std::optional<BlockSums> first;
      test::on_each_target([&](const char* target) {
        const BlockSums sums = passes.run_code_pass(shot.frames);
        if (!first) first = sums;
        EXPECT_EQ(find_difference(sums, *first), "") << target;
      });
      const Truth truth = c.truth(shot.frames, edge);
      const Deviations o = deviations(*first, truth);
      EXPECT_LT(o.sum, 5e-3);
      EXPECT_GT(o.peak_low, 0.9) << "a peak was missed";
      EXPECT_GT(o.noise, 0.8);
      EXPECT_LT(o.noise, 1.2);
    }
  });
}

TEST_P(EveryCodeFormat, CentroidOfALampInTheCornerOfABlockIsMeasured) {
  // Centroid offsets are used by the correction of centroids.
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
    const BlockSums sums = passes.run_code_pass(shot.frames);
    double largest = 0;
    for (const reference::BlockLight& b : truth.blocks) largest = std::max(largest, std::hypot(b.offset.x, b.offset.y));
    EXPECT_GT(largest, 0.2 * edge) << "the scene has no large offset";
    // Tolerance relative to the largest luminance: solid angle and vignetting vary by percents across a block of 16,
    // and a site of a mosaic is assigned to the middle of its quad.
    EXPECT_LT(deviations(sums, truth).moment, 0.15) << edge;
  }
}

TEST_P(EveryCodeFormat, CodePassRefusesUnsupportedFrames) {
  const double one[] = {1}, three[] = {1, 0.5, 0.25};
  OracleCase wide("pair", 66, 64, GetParam(), curves_for(GetParam()).front());
  // A picture is at least 16 pixels wide: enough for vectors of 16 bytes.
  OracleCase narrow("pair", std::max(static_cast<int>(kMinLanes) - 2, 16), 64, GetParam(),
                    curves_for(GetParam()).front());
  const reference::RandomScene scene(1);
  EXPECT_TRUE(Passes(wide, 8).codes.supports(wide.shoot(scene, one).frames));
  EXPECT_FALSE(Passes(wide, 8).codes.supports(wide.shoot(scene, three).frames)) << "a bracket";
  EXPECT_FALSE(Passes(wide, 1).codes.supports(wide.shoot(scene, one).frames)) << "blocks of one pixel";
  EXPECT_EQ(Passes(narrow, 8).codes.supports(narrow.shoot(scene, one).frames), kMinLanes == 16)
      << "narrower than a vector";
}

INSTANTIATE_TEST_SUITE_P(CodePass, EveryCodeFormat,
                         testing::Values(PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv,
                                         PixelFormat::bayer_rggb8, PixelFormat::bayer_rggb10,
                                         PixelFormat::bayer_rggb12),
                         [](const auto& p) { return std::string(to_string(p.param)); });

}  // namespace
}  // namespace lightwell::estimate
