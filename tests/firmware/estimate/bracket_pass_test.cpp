// Compares BracketPass with BlockPass on every Highway target of this machine.
#include "estimate/panorama/bracket_pass.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "brackets.hpp"
#include "each_target.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"
#include "parts_of_picture.hpp"

namespace lightwell::estimate {
namespace {

using namespace testing_scenes;

struct Case {
  const char* rig;
  int width, height, edge;
  PixelFormat format;
  std::vector<double> exposures;
  double gamma = 0;  ///< Of the response; 0: that of the rig, 1: linear.
};

/// Full scale is a radiance of 0.01 / exposure (firmware/sim/sensor.hpp).
const std::vector<double> kThree{1e-5, 3.3e-4, 5e-3};

void check(const Case& c) {
  SCOPED_TRACE(std::string(to_string(c.format)) + " " + c.rig + " " + std::to_string(c.width) + "x" +
               std::to_string(c.height) + ", blocks of " + std::to_string(c.edge) + ", " +
               std::to_string(c.exposures.size()) + " exposures, gamma " + std::to_string(c.gamma));
  RigParameters rig = rig_of(c.rig, c.width, c.height, c.format);
  for (LensParameters& lens : rig.lenses) {
    if (c.gamma == 1) lens.photometry.response.kind = ResponseCurve::Kind::linear;
    if (c.gamma > 1) lens.photometry.response = {ResponseCurve::Kind::gamma, {}, c.gamma};
    lens.photometry.white_balance = {1.2, 1, 0.8};
  }
  const RigTable table = *make_rig_table(rig);
  const std::vector<RadianceOf> scenes(c.exposures.size(), furnished_room());
  const Bracket bracket = bracket_of(rig, table, c.format, scenes, c.exposures);
  const BlockLayout layout(table, c.edge);
  BlockPass block_pass(table, layout);
  RowReader reader(rig, table);
  ASSERT_TRUE(reader.bind(bracket.frames).ok());
  BlockSums expected(layout);
  block_pass.run(reader, expected);
  double total = 0, largest = 0;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    total += expected.sum[i].luminance();
    largest = std::max(largest, static_cast<double>(expected.peak[i]));
  }
  const bool mosaic = is_bayer(c.format), chroma = c.format == PixelFormat::yuyv || c.format == PixelFormat::nv12;

  test::on_each_target([&](const char* target) {
    SCOPED_TRACE(target);
    BracketPass pass(rig, table, layout);
    ASSERT_TRUE(pass.supports(bracket.frames));
    BlockSums got(layout);
    pass.run(bracket.frames, {}, {}, got);
    EXPECT_EQ(test::difference_of_parts(pass, bracket.frames, got, layout), "");
    double difference = 0;
    std::size_t excluded_blocks = 0;
    for (std::size_t i = 0; i < layout.size(); ++i) {
      if (got.exposures[i] != c.exposures.size()) {
        // Shared chroma that includes saturated pixels is wrong: at an edge it may look like motion.
        ASSERT_TRUE(chroma) << "nothing moved in block " << i;
        ++excluded_blocks;
        continue;
      }
      const CellSum a = expected.sum[i], b = got.sum[i];
      difference += std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b);
      // The weight of a mosaic's quad is that of its brightest site; where greens differ, exposures are weighted
      // differently.
      const double tolerance = mosaic ? 1e-2 : 1e-4;
      ASSERT_NEAR(b.luminance(), a.luminance(), tolerance * std::abs(a.luminance()) + 1e-8 * total) << "block " << i;
      ASSERT_NEAR(got.peak[i], expected.peak[i], (mosaic ? 2e-2 : 2e-4) * expected.peak[i] + 1e-6 * largest)
          << "block " << i;
      // BracketPass puts the light of a quad in its middle, BlockPass in its pixels.
      const double tolerance_px = mosaic ? 1 : 2e-3;
      ASSERT_NEAR(got.offset_x[i], expected.offset_x[i], tolerance_px) << "block " << i;
      ASSERT_NEAR(got.offset_y[i], expected.offset_y[i], tolerance_px) << "block " << i;
    }
    EXPECT_LT(difference, (mosaic ? 3e-4 : 3e-5) * 3 * total);
    EXPECT_NEAR(got.clipped_sr, expected.clipped_sr, 1e-5 * expected.clipped_sr + 1e-9);
    EXPECT_NEAR(got.noise, expected.noise, 0.2 * expected.noise);
    // BracketPass uses the largest bias of dark codes, not that of each code, and the step of green codes, where
    // BlockPass uses that of the brightest channel.
    EXPECT_GE(got.bias, 0.4 * expected.bias - 1e-6 * total);
    EXPECT_LE(got.bias, 3 * expected.bias + 3e-4 * total);
    EXPECT_LE(excluded_blocks, layout.size() / 500);
    EXPECT_LE(got.motion_luminance, chroma ? 1e-3 * total : 0);
    for (std::size_t b = 0; b < got.clipped.size(); ++b)
      EXPECT_NEAR(got.clipped[b], expected.clipped[b], 1e-5 * expected.clipped[b] + 1e-9) << b;
  });
}

TEST(BracketPass, EqualsBlockPassInEveryFormat) {
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv, PixelFormat::bayer_rggb8,
                                   PixelFormat::bayer_rggb10, PixelFormat::bayer_rggb12})
    for (const char* rig : {"pair", "equirect"})
      check({rig, rig[0] == 'p' ? 160 : 256, rig[0] == 'p' ? 120 : 128, 8, format, kThree});
}

TEST(BracketPass, EqualsBlockPassForEveryResponse) {
  for (const double gamma : {1.0, 2.2}) check({"pair", 160, 120, 8, PixelFormat::rgb8, kThree, gamma});
  check({"equirect", 256, 128, 8, PixelFormat::yuyv, kThree, 1});
}

TEST(BracketPass, EqualsBlockPassForEverySize) {
  for (const int edge : {2, 4, 16}) check({"pair", 160, 120, edge, PixelFormat::rgb8, kThree});
  for (const int width : {130, 154, 198}) {
    check({"equirect", width, width / 2, 8, PixelFormat::rgb8, kThree});
    check({"pair", width, 102, 8, PixelFormat::nv12, kThree});
    check({"pair", width, 102, 8, PixelFormat::bayer_rggb12, kThree});
  }
  // Wider than one chunk.
  check({"equirect", 900, 450, 8, PixelFormat::rgb8, kThree});
}

TEST(BracketPass, EqualsBlockPassForTwoToEightExposures) {
  check({"pair", 160, 120, 8, PixelFormat::rgb8, {5e-3, 1e-5}});
  check({"pair", 160, 120, 8, PixelFormat::rgb8, {3.3e-4, 5e-3, 1e-5, 1e-4}});
  check({"pair", 160, 120, 8, PixelFormat::rgb8, {1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2}});
  check({"pair", 160, 120, 8, PixelFormat::rgb8, {1e-4, 1e-4, 1e-4}});
}

TEST(BracketPass, GivesALowerBoundWhereEveryExposureIsClipped) {
  check({"pair", 160, 120, 8, PixelFormat::rgb8, {3e-4, 3e-3}});
  check({"pair", 160, 120, 8, PixelFormat::rgb8, {0.1, 1.0}});
  check({"pair", 160, 120, 8, PixelFormat::bayer_rggb12, {0.1, 1.0}});
}

TEST(BracketPass, RefusesUnsupportedBrackets) {
  const auto supports = [](PixelFormat format, int width, int height, std::size_t exposures, int edge) {
    const RigParameters rig = rig_of("pair", width, height, format);
    const RigTable table = *make_rig_table(rig);
    const std::vector<RadianceOf> scenes(exposures, furnished_room());
    const Bracket b = bracket_of(rig, table, format, scenes, std::span(kThree).first(exposures));
    const BlockLayout layout(table, edge);
    return BracketPass(rig, table, layout).supports(b.frames);
  };
  EXPECT_TRUE(supports(PixelFormat::rgb8, 64, 48, 2, 8));
  // A picture is at least 16 pixels wide: enough for vectors of 16 bytes.
  constexpr int kLanes = static_cast<int>(kMinLanes), kNarrow = std::max(kLanes - 2, 16);
  EXPECT_EQ(supports(PixelFormat::rgb8, kNarrow, 48, 2, 8), kLanes == 16) << "narrower than a vector";
  EXPECT_FALSE(supports(PixelFormat::bayer_rggb8, 2 * kLanes - 2, 96, 2, 8)) << "in quads";
  EXPECT_FALSE(supports(PixelFormat::rgb8, 64, 48, 1, 8));
  EXPECT_FALSE(supports(PixelFormat::rgb_f32, 64, 48, 2, 8));
  EXPECT_FALSE(supports(PixelFormat::bayer_rggb8, 128, 96, 2, 1)) << "a quad would lie in several blocks";
}

}  // namespace
}  // namespace lightwell::estimate
