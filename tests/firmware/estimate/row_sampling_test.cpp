// Blocks of which a part of the rows is read have the light of blocks that are read whole, or are read whole.
#include "estimate/panorama/row_sampling.hpp"

#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "brackets.hpp"
#include "estimate/common/error_bound.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/sphere_integrator.hpp"

namespace lightwell::estimate {
namespace {

using namespace testing_scenes;

/// What `balanced` allows at an epsilon of 1 %.
constexpr double kMaxRowError = 5e-5;

constexpr PixelFormat kFormats[] = {PixelFormat::rgb8,        PixelFormat::nv12,         PixelFormat::yuyv,
                                    PixelFormat::bayer_rggb8, PixelFormat::bayer_rggb10, PixelFormat::bayer_rggb12};
/// Full scale is a radiance of 0.01 / exposure (firmware/sim/sensor.hpp).
const std::vector<double> kOne{3.3e-3}, kThree{1e-5, 3.3e-4, 5e-3};

class Integrals {
 public:
  Integrals(const RigParameters& rig, int edge)
      : rig_(rig), table_(*make_rig_table(rig_)), reader_(rig_, table_), integrator_(rig_, table_, edge) {}

  /// A copy: the next call writes to the same sums.
  FrameIntegral of(std::span<const Frame> bracket, double max_row_error) {
    const Status s = reader_.bind(bracket);
    EXPECT_TRUE(s.ok()) << s.message();
    return integrator_.integrate(reader_, bracket, UnseenFill::mirror, {1, max_row_error});
  }
  [[nodiscard]] const RigTable& table() const { return table_; }
  [[nodiscard]] const BlockLayout& layout() const { return integrator_.layout(); }

 private:
  RigParameters rig_;
  RigTable table_;
  RowReader reader_;
  SphereIntegrator integrator_;
};

std::size_t blocks_in_part(const FrameIntegral& integral) {
  std::size_t count = 0;
  for (const RowError& error : integral.blocks.row_error_of_block) count += error.own > 0 ? 1 : 0;
  return count;
}

/// RMS irradiance of the difference, relative to that of `a`.
double difference_of(const FrameIntegral& a, const FrameIntegral& b) {
  Projection difference;
  for (std::size_t i = 0; i < kRowCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) difference.c[i][k] = b.projection.c[i][k] - a.projection.c[i][k];
  return irradiance_rms(difference).plain / irradiance_rms(a.projection).plain;
}

/// What the bound adds for rows that were not read, relative to the same.
double bound_of(const FrameIntegral& integral) {
  return integral.blocks.row_error() / std::sqrt(6.0) / irradiance_rms(integral.projection).plain;
}

struct Case {
  PixelFormat format;
  int edge;
  std::vector<double> exposures;
  [[nodiscard]] std::string name() const {
    return std::string(to_string(format)) + ", blocks of " + std::to_string(edge) + ", " +
           std::to_string(exposures.size()) + " exposures";
  }
};

std::vector<Case> cases() {
  std::vector<Case> out;
  for (const PixelFormat format : kFormats)
    for (const int edge : {8, 16})
      for (const auto& exposures : {kOne, kThree}) out.push_back({format, edge, exposures});
  return out;
}

RigParameters nonlinear_rig(const char* kind, PixelFormat format) {
  RigParameters rig = rig_of(kind, 480, 360, format);
  for (LensParameters& lens : rig.lenses) {
    lens.photometry.white_balance = {1.2, 1, 0.8};
    if (format == PixelFormat::bayer_rggb8) lens.photometry.response = {ResponseCurve::Kind::gamma, {}, 2.2};
  }
  return rig;
}

TEST(RowSampling, GivesTheLightOfAllRowsWithinItsShareOfTheBound) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name());
    const RigParameters rig = nonlinear_rig("pair", c.format);
    Integrals integrals(rig, c.edge);
    const std::vector<RadianceOf> scenes(c.exposures.size(), furnished_room());
    const Bracket bracket = bracket_of(rig, integrals.table(), c.format, scenes, c.exposures);
    const FrameIntegral whole = integrals.of(bracket.frames, 0), part = integrals.of(bracket.frames, kMaxRowError);
    // Of one exposure, linear codes and blocks of 8 rows are not sampled.
    const bool all = c.exposures.size() == 1 &&
                     (c.edge == 8 || c.format == PixelFormat::bayer_rggb10 || c.format == PixelFormat::bayer_rggb12);
    // The room has edges in many blocks, the more the larger they are.
    EXPECT_GE(blocks_in_part(part), all ? 0 : integrals.layout().size() / (c.edge == 8 ? 5 : 20));
    EXPECT_LE(blocks_in_part(part), all ? 0 : integrals.layout().size());
    EXPECT_LE(difference_of(whole, part), bound_of(part));
    // A third of epsilon.
    EXPECT_LT(bound_of(part), 3.3e-3);
    EXPECT_NEAR(part.blocks.clipped_sr, whole.blocks.clipped_sr, 1e-6);
  }
}

TEST(RowSampling, OfAUniformSphereIsExact) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name());
    const RigParameters rig = nonlinear_rig("pair", c.format);
    Integrals integrals(rig, c.edge);
    const std::vector<RadianceOf> scenes(c.exposures.size(), [](Vec3d) { return Radiance{1, 0.9F, 0.8F}; });
    const Bracket bracket = bracket_of(rig, integrals.table(), c.format, scenes, c.exposures);
    const FrameIntegral whole = integrals.of(bracket.frames, 0), part = integrals.of(bracket.frames, kMaxRowError);
    // The noise of the rows that are not decoded. Where samples of chroma are shared, there are fewer of these than the
    // model of the noise counts: 4 in a row of 8 pixels, for 16 pixels of a block.
    const double rms = irradiance_rms(part.projection).plain;
    EXPECT_LT(difference_of(whole, part), 3 * noise_rms({.noise = part.blocks.noise}) / rms + 4e-4);
    for (std::size_t block = 0; block < part.blocks.sum.size(); ++block) {
      const float a = whole.blocks.sum[block].luminance(), b = part.blocks.sum[block].luminance();
      ASSERT_NEAR(b, a, 5 * std::sqrt(part.blocks.block_noise[block]) + 0.02F * a) << "block " << block;
      if (part.blocks.row_error_of_block[block].own > 0) {
        ASSERT_NEAR(part.blocks.offset_y[block], whole.blocks.offset_y[block], 0.1F) << "block " << block;
      }
    }
  }
}

/// A grey picture of RGB8 codes.
struct GreyPicture {
  RigParameters rig = rig_of("equirect", 512, 256, PixelFormat::rgb8);
  std::vector<std::byte> pixels = std::vector<std::byte>(std::size_t{3} * 512 * 256, std::byte{60});
  Frame frame;

  GreyPicture() {
    frame.info.exposure_s = 0.01;
    frame.add_view({0, PixelFormat::rgb8, 512, 256, std::size_t{3} * 512, pixels});
  }
  void set(int x, int y, std::uint8_t code) {
    for (std::size_t c = 0; c < 3; ++c)
      pixels[3 * (static_cast<std::size_t>(y) * 512 + static_cast<std::size_t>(x)) + c] = std::byte{code};
  }
};

TEST(RowSampling, ReadsALampOfOnePixelInEveryRow) {
  GreyPicture picture;
  Integrals integrals(picture.rig, 16);
  for (int row = 0; row < 16; ++row) {
    // In the middle of the picture, where a block of 16 rows has a 500th of the light.
    const int x = 256 + row, y = 128 + row;
    picture.set(x, y, 255);
    const FrameIntegral whole = integrals.of(std::span(&picture.frame, 1), 0),
                        part = integrals.of(std::span(&picture.frame, 1), kMaxRowError);
    picture.set(x, y, 60);
    const std::size_t block = integrals.layout().block_of(0, x, y);
    EXPECT_EQ(part.blocks.sum[block].g, whole.blocks.sum[block].g) << "row " << row;
    EXPECT_EQ(part.blocks.peak[block], whole.blocks.peak[block]) << "row " << row;
    EXPECT_EQ(part.blocks.offset_y[block], whole.blocks.offset_y[block]) << "row " << row;
  }
}

TEST(RowSampling, IsNotDeceivedByStripesOverTheWholeSphere) {
  for (const int period : {2, 3, 4, 5, 8, 16})
    for (const int contrast : {5, 20, 60, 195}) {
      GreyPicture picture;
      Integrals integrals(picture.rig, 16);
      for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 512; ++x)
          picture.set(x, y, static_cast<std::uint8_t>(y % period < period / 2 ? 60 : 60 + contrast));
      const FrameIntegral whole = integrals.of(std::span(&picture.frame, 1), 0),
                          part = integrals.of(std::span(&picture.frame, 1), kMaxRowError);
      // The weights of a block fit a plane within 5e-4, and not in all blocks with the same sign.
      EXPECT_LE(difference_of(whole, part), 1e-4 + bound_of(part))
          << "period " << period << ", codes 60 and " << 60 + contrast;
    }
}

TEST(RowSampling, OfRandomPixelsHasTheErrorOfItsShareOfTheBound) {
  std::mt19937 random(5);
  GreyPicture picture;
  Integrals integrals(picture.rig, 16);
  for (const int largest : {20, 80, 255}) {
    for (std::byte& code : picture.pixels) code = static_cast<std::byte>(random() % static_cast<unsigned>(largest));
    const FrameIntegral whole = integrals.of(std::span(&picture.frame, 1), 0),
                        part = integrals.of(std::span(&picture.frame, 1), kMaxRowError);
    EXPECT_LE(difference_of(whole, part), bound_of(part)) << "codes up to " << largest;
  }
}

TEST(RowSampling, CountsTheSaturatedSolidAngle) {
  GreyPicture picture;
  Integrals integrals(picture.rig, 16);
  for (int y = 100; y < 133; ++y)
    for (int x = 200; x < 257; ++x) picture.set(x, y, 255);
  const FrameIntegral whole = integrals.of(std::span(&picture.frame, 1), 0),
                      part = integrals.of(std::span(&picture.frame, 1), kMaxRowError);
  ASSERT_GT(whole.blocks.clipped_sr, 0.1);
  EXPECT_NEAR(part.blocks.clipped_sr, whole.blocks.clipped_sr, 1e-5 * whole.blocks.clipped_sr);
}

TEST(RowSampling, HasNoMemory) {
  GreyPicture first, second;
  for (int x = 100; x < 140; ++x) second.set(x, 77, 250);
  Integrals integrals(first.rig, 16);
  const FrameIntegral before = integrals.of(std::span(&first.frame, 1), kMaxRowError);
  (void)integrals.of(std::span(&second.frame, 1), kMaxRowError);
  const FrameIntegral after = integrals.of(std::span(&first.frame, 1), kMaxRowError);
  for (std::size_t block = 0; block < before.blocks.sum.size(); ++block) {
    ASSERT_EQ(before.blocks.sum[block].g, after.blocks.sum[block].g) << block;
    ASSERT_EQ(before.blocks.row_error_of_block[block].own, after.blocks.row_error_of_block[block].own) << block;
  }
  EXPECT_EQ(before.projection.c, after.projection.c);
}

TEST(RowSampling, OfAMissingLensKeepsNothing) {
  const RigParameters rig = nonlinear_rig("pair", PixelFormat::rgb8);
  Integrals used(rig, 16), fresh(rig, 16);
  const std::vector<RadianceOf> scenes(1, furnished_room());
  // Too long an exposure: both lenses have saturated pixels.
  const std::vector<double> exposure{0.05};
  const Bracket both = bracket_of(rig, used.table(), PixelFormat::rgb8, scenes, exposure);
  ASSERT_GT(used.of(both.frames, kMaxRowError).blocks.clipped_sr, 0.1);
  Frame first;
  first.info = both.frames[0].info;
  first.add_view(both.frames[0].views()[0]);
  const FrameIntegral expected = fresh.of(std::span(&first, 1), kMaxRowError),
                      got = used.of(std::span(&first, 1), kMaxRowError);
  EXPECT_EQ(got.blocks.clipped_sr, expected.blocks.clipped_sr);
  EXPECT_EQ(got.blocks.noise, expected.blocks.noise);
  EXPECT_EQ(got.blocks.row_error(), expected.blocks.row_error());
  EXPECT_EQ(got.projection.c, expected.projection.c);
}

TEST(RowSampling, IsOffInTheDarkAndForSmallBlocks) {
  GreyPicture picture;
  for (const int edge : {2, 4}) {
    Integrals integrals(picture.rig, edge);
    EXPECT_EQ(blocks_in_part(integrals.of(std::span(&picture.frame, 1), kMaxRowError)), 0U) << edge;
  }
  std::fill(picture.pixels.begin(), picture.pixels.end(), std::byte{0});
  Integrals integrals(picture.rig, 16);
  const FrameIntegral whole = integrals.of(std::span(&picture.frame, 1), 0),
                      dark = integrals.of(std::span(&picture.frame, 1), kMaxRowError);
  for (std::size_t block = 0; block < dark.blocks.sum.size(); ++block)
    ASSERT_EQ(dark.blocks.sum[block].g, whole.blocks.sum[block].g) << block;
  EXPECT_EQ(dark.blocks.row_error(), 0);
}

}  // namespace
}  // namespace lightwell::estimate
