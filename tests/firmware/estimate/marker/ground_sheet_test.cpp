// The sheet under a ball: what a ground sample shows, and shadows that run on over the sheet's edge.
#include "estimate/marker/ground_sheet.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/shipped_bodies.hpp"

namespace lightwell::marker {
namespace {

using test::pinhole;
using test::shipped_body;

TEST(GroundSheet, CoverIsSheetTableOrMixed) {
  const MarkerBody body = shipped_body("ball_40mm");
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  const PosedBody posed(body, lens, model, {Quat::about({1, 0, 0}, 0.7), {0, 0, -0.6}});
  const auto at = [&](double x, double y) {
    return ground_cover(body, posed, posed.point_of(body.faces[0], {x, y}), 0.002);
  };
  // The sheet reaches from -5 to 5 cm and from -3 to 7 cm, the tag from -1.2 to 1.2 cm.
  EXPECT_EQ(at(0.03, 0.03), GroundCover::sheet);
  EXPECT_EQ(at(0.06, 0.03), GroundCover::table);
  EXPECT_EQ(at(0.03, -0.04), GroundCover::table);
  EXPECT_EQ(at(0.05, 0.03), GroundCover::mixed) << "the sheet's edge";
  EXPECT_EQ(at(0.05 - 0.0029, 0.03), GroundCover::sheet);
  EXPECT_EQ(at(0.05 + 0.0029, 0.03), GroundCover::table);
  EXPECT_EQ(at(0, 0), GroundCover::mixed) << "the tag";
  EXPECT_EQ(at(0.012, 0.013), GroundCover::mixed) << "the tag's edge";
}

TEST(GroundSheet, OtherBodiesHaveNone) {
  const MarkerBody body = shipped_body("cube_60mm_grey");
  const LensParameters lens = pinhole();
  const CameraModel model(lens);
  const PosedBody posed(body, lens, model, {{}, {0, 0, -0.6}});
  EXPECT_EQ(ground_cover(body, posed, {0, -0.03, 0}, 0.002), GroundCover::table);
}

GroundPlane coloured(const std::vector<Rgb>& colours) {
  GroundPlane out;
  for (const Rgb& c : colours) {
    GroundSample sample;
    sample.color = c;
    sample.radiance = (c[0] + c[1] + c[2]) / 3;
    sample.sigma = 0.01 * sample.radiance;
    out.samples.push_back(sample);
  }
  return out;
}

TEST(GroundClutter, ObjectsOfAnotherColourGoAndColouredShadowsStay) {
  // Light of 6,500 and of 2,700 K in linear sRGB, on a brown table.
  const Rgb table = {0.4, 0.3, 0.2}, cold = {1, 1, 1}, warm = {1, 0.60, 0.23}, turquoise = {0.2, 0.5, 0.5};
  const auto lit = [](const Rgb& albedo, const Rgb& light, double power) {
    return Rgb{albedo[0] * light[0] * power, albedo[1] * light[1] * power, albedo[2] * light[2] * power};
  };
  std::vector<Rgb> colours;
  for (int k = 0; k < 20; ++k) colours.push_back(lit(table, cold, 1));
  for (int k = 0; k < 10; ++k) colours.push_back(lit(table, warm, 0.3));
  for (int k = 0; k < 5; ++k) colours.push_back(lit(turquoise, cold, 1));
  GroundPlane ground = coloured(colours);
  std::vector<GroundCover> covers(colours.size(), GroundCover::table);
  remove_clutter(ground, covers);
  ASSERT_EQ(ground.samples.size(), 30U);
  EXPECT_EQ(covers.size(), 30U);
  for (const GroundSample& sample : ground.samples) EXPECT_GT(sample.color[0], sample.color[2]);
}

TEST(GroundClutter, SheetAndTableHaveColoursOfTheirOwn) {
  std::vector<Rgb> colours(12, Rgb{0.8, 0.8, 0.8});
  std::vector<GroundCover> covers(12, GroundCover::sheet);
  for (int k = 0; k < 12; ++k) colours.push_back({0.1, 0.3, 0.1}), covers.push_back(GroundCover::table);
  GroundPlane ground = coloured(colours);
  remove_clutter(ground, covers);
  EXPECT_EQ(ground.samples.size(), 24U);
}

TEST(GroundClutter, BlackAndGreyStay) {
  GroundPlane ground = coloured(std::vector<Rgb>(8, Rgb{}));
  std::vector<GroundCover> covers(8, GroundCover::table);
  remove_clutter(ground, covers);
  EXPECT_EQ(ground.samples.size(), 8U);
  ground.samples.clear(), covers.clear();
  remove_clutter(ground, covers);
  EXPECT_TRUE(ground.samples.empty());
}

/// A line of samples from the sheet to the table; light falls by a half at every other sample, as by a shadow's edges.
struct Line {
  GroundPlane ground{.point = {}, .normal = {0, 1, 0}, .step_m = 0.01, .density = 1, .samples = {}};
  std::vector<GroundCover> covers;

  explicit Line(int on, int off) {
    for (int row = 0; row < 4; ++row)
      for (int i = 0; i < on + off; ++i) {
        const bool sheet = i < on;
        const double light = row % 2 == 0 ? 1 : 0.5, albedo = sheet ? 0.8 : 0.2;
        GroundSample sample;
        sample.position = {0.01 * i, 0, 0.01 * row};
        sample.radiance = light * albedo;
        sample.sigma = 0.01 * albedo;
        sample.color = {light * albedo, light * albedo, light * albedo};
        ground.samples.push_back(sample);
        covers.push_back(sheet ? GroundCover::sheet : GroundCover::table);
      }
  }
};

TEST(GroundSheet, HasTheTablesAlbedoAfterwards) {
  Line line(5, 6);
  equalize_sheet(line.ground, line.covers);
  ASSERT_EQ(line.ground.samples.size(), 44U);
  for (std::size_t i = 0; i < line.covers.size(); ++i) {
    const GroundSample& sample = line.ground.samples[i];
    const double light = (i / 11) % 2 == 0 ? 1 : 0.5;
    EXPECT_NEAR(sample.radiance, 0.2 * light, 1e-12) << i;
    EXPECT_NEAR(sample.sigma, 0.002, 1e-12) << i;
    EXPECT_NEAR(sample.color[1], (line.covers[i] == GroundCover::sheet ? 0.8 : 0.2) * light, 1e-12)
        << "the light that the sheet reflects stays";
    EXPECT_NEAR(sample.table_ratio, line.covers[i] == GroundCover::sheet ? 0.25 : 1, 1e-12) << i;
  }
}

TEST(GroundSheet, WithoutNeighboursAcrossTheEdgeTheSmallerPartIsRemoved) {
  for (const bool sheet_is_larger : {true, false}) {
    Line line(sheet_is_larger ? 8 : 3, sheet_is_larger ? 3 : 8);
    for (std::size_t i = 0; i < line.covers.size(); ++i)
      if (line.covers[i] == GroundCover::table) line.ground.samples[i].position.x += 0.1;
    equalize_sheet(line.ground, line.covers);
    ASSERT_EQ(line.ground.samples.size(), 32U);
    for (const GroundSample& sample : line.ground.samples)
      EXPECT_GE(sample.radiance, sheet_is_larger ? 0.4 : 0.1) << sample.position.x;
    for (const GroundSample& sample : line.ground.samples)
      EXPECT_LE(sample.radiance, sheet_is_larger ? 0.8 : 0.2) << sample.position.x;
  }
}

TEST(GroundSheet, OneKindAloneIsKeptAsItIs) {
  for (const GroundCover cover : {GroundCover::sheet, GroundCover::table}) {
    Line line(3, 0);
    line.covers.assign(line.covers.size(), cover);
    equalize_sheet(line.ground, line.covers);
    EXPECT_EQ(line.ground.samples.size(), 12U);
    EXPECT_EQ(line.ground.samples[0].radiance, 0.8);
  }
  GroundPlane none{.point = {}, .normal = {0, 1, 0}, .step_m = 0.01, .density = 1, .samples = {}};
  equalize_sheet(none, {});
  EXPECT_TRUE(none.samples.empty());
}

TEST(GroundSheet, BlackSamplesGiveNoRatio) {
  Line line(5, 6);
  for (GroundSample& sample : line.ground.samples) sample.radiance = 0;
  equalize_sheet(line.ground, line.covers);
  for (const GroundSample& sample : line.ground.samples) EXPECT_EQ(sample.radiance, 0);
}

}  // namespace
}  // namespace lightwell::marker
