// Validation of marker bodies, and round trip through text.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/marker_body.hpp>

#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// One face of 60 mm with one patch beside its tag.
MarkerBody body() {
  MarkerBody out;
  out.name = "card";
  out.tag_size_m = 0.024;
  MarkerFace face;
  face.tag_id = 3;
  face.body_face = {{0, 0, 0, 1}, {0, 0, 0.03}};
  face.outline = {{-0.03, -0.03}, {0.03, -0.03}, {0.03, 0.03}, {-0.03, 0.03}};
  face.patches.push_back({{{0.015, 0}, {0.03, 0}, {0.03, 0.015}, {0.015, 0.015}}, {0.8, 0.8, 0.8}});
  out.faces.push_back(face);
  return out;
}

/// The error message for a valid body modified by `spoil`.
template <class Spoil>
std::string refusal(Spoil spoil) {
  MarkerBody b = body();
  spoil(b);
  const Status s = b.validate();
  EXPECT_EQ(s.code(), StatusCode::invalid_argument);
  return s.message();
}

std::string refusal_of_text(const std::string& text) {
  const Result<MarkerBody> b = parse_marker_body(text, "cube.textproto");
  EXPECT_FALSE(b.ok()) << text;
  return b ? "" : b.status().message();
}

/// A body in text format, with `more` after the fields of its only face.
std::string text_with(const std::string& more, const std::string& outside = "") {
  return "tag_family: \"tag36h11\"\ntag_size_m: 0.024\nface {\n  tag_id: 3\n  pose { qw: 1 }\n"
         "  outline_m: [0, 0, 1, 0, 1, 1, 0, 1]\n" +
         more + "}\n" + outside;
}

TEST(MarkerBody, ValidBodyPasses) {
  EXPECT_TRUE(body().validate().ok()) << body().validate().message();
  MarkerBody with_ball = body();
  with_ball.ball = MarkerBall{{0, 0.1, 0}, 0.02, {0.7, 0.6, 0.5}};
  EXPECT_TRUE(with_ball.validate().ok());
}

TEST(MarkerBody, TagFamilyAndSizeAreChecked) {
  EXPECT_THAT(refusal([](MarkerBody& b) { b.tag_family = "tag16h5"; }),
              HasSubstr("'tag16h5' is not known; tag36h11 and tagStandard41h12 are"));
  for (const double size : {0.0, -0.024, kNan, kInf})
    EXPECT_THAT(refusal([&](MarkerBody& b) { b.tag_size_m = size; }),
                HasSubstr("tag_size_m must be positive and finite"));
}

TEST(MarkerBody, TagNumbersAreUniqueAndNonNegative) {
  EXPECT_THAT(refusal([](MarkerBody& b) { b.faces.clear(); }), HasSubstr("needs at least one, with a tag"));
  EXPECT_THAT(refusal([](MarkerBody& b) {
                for (int i = 0; i < 64; ++i) b.faces.push_back(b.faces[0]), b.faces.back().tag_id = 100 + i;
              }),
              HasSubstr("more than 64 faces"));
  EXPECT_THAT(refusal([](MarkerBody& b) { b.faces[0].tag_id = -1; }), HasSubstr("tag_id must not be negative"));
  EXPECT_THAT(refusal([](MarkerBody& b) { b.faces.push_back(b.faces[0]); }), HasSubstr("face of tag 3: occurs twice"));
}

TEST(MarkerBody, FacePosesAreChecked) {
  EXPECT_THAT(refusal([](MarkerBody& b) {
                b.faces[0].body_face.rotation = {0, 0, 0, 0};
              }),
              HasSubstr("face of tag 3: pose has no rotation"));
  EXPECT_THAT(refusal([](MarkerBody& b) { b.faces[0].body_face.rotation.x = kNan; }),
              HasSubstr("pose has no rotation"));
  EXPECT_THAT(refusal([](MarkerBody& b) { b.faces[0].body_face.translation.y = kInf; }),
              HasSubstr("tx, ty, tz must be finite"));
}

TEST(MarkerBody, OutlinesAreConvexAndCounterClockwise) {
  const auto outline = [](FaceOutline points) {
    return refusal([&](MarkerBody& b) { b.faces[0].outline = points, b.faces[0].patches.clear(); });
  };
  EXPECT_THAT(outline({{0, 0}, {1, 0}}), HasSubstr("needs three points or more"));
  EXPECT_THAT(outline({{0, 0}, {1, 0}, {1, kNan}}), HasSubstr("outline_m must be finite"));
  EXPECT_THAT(outline({{0, 0}, {1, 0}, {1, 0}, {0, 1}}), HasSubstr("has point 1 twice"));
  EXPECT_THAT(outline({{0, 0}, {0, 1}, {1, 0}}), HasSubstr("convex and counter-clockwise")) << "clockwise";
  EXPECT_THAT(outline({{0, 0}, {1, 0}, {0.2, 0.2}, {0, 1}}), HasSubstr("convex and counter-clockwise")) << "a dent";
  EXPECT_THAT(outline({{1, 0}, {-0.8, 0.6}, {0.3, -0.95}, {0.3, 0.95}, {-0.8, -0.6}}), HasSubstr("convex")) << "a star";
  EXPECT_THAT(outline({{0, 0}, {1, 0}, {2, 0}}), HasSubstr("has no area"));
}

TEST(MarkerBody, PatchesAreInsideTheirFaceWithAValidAlbedo) {
  EXPECT_THAT(refusal([](MarkerBody& b) { b.faces[0].patches[0].outline.resize(2); }),
              HasSubstr("face of tag 3, patch 0: outline_m needs three points"));
  EXPECT_THAT(refusal([](MarkerBody& b) {
                // Half of it is beyond the edge.
                b.faces[0].patches.push_back({{{0.02, 0}, {0.04, 0}, {0.04, 0.01}, {0.02, 0.01}}, {0.8, 0.8, 0.8}});
              }),
              HasSubstr("face of tag 3, patch 1: lies outside of its face"));
  MarkerBody rounded = body();
  for (FacePoint& p : rounded.faces[0].patches[0].outline)
    if (p.x == 0.03) p.x += 5e-7;
  EXPECT_TRUE(rounded.validate().ok()) << "half a micrometre beyond the edge is within the rounding tolerance";
  for (const double albedo : {0.0, -0.1, 1.01, kNan})
    for (const std::size_t channel : {0U, 1U, 2U})
      EXPECT_THAT(refusal([&](MarkerBody& b) { b.faces[0].patches[0].albedo[channel] = albedo; }),
                  HasSubstr("patch 0: albedo must be above 0 and at most 1"));
}

TEST(MarkerBody, BallIsChecked) {
  const auto ball = [](MarkerBall wrong) { return refusal([&](MarkerBody& b) { b.ball = wrong; }); };
  EXPECT_THAT(ball({{0, kNan, 0}, 0.02, {0.8, 0.8, 0.8}}), HasSubstr("ball: center_m must be finite"));
  for (const double radius : {0.0, -0.02, kInf})
    EXPECT_THAT(ball({{0, 0, 0}, radius, {0.8, 0.8, 0.8}}), HasSubstr("ball: radius_m must be positive and finite"));
  EXPECT_THAT(ball({{0, 0, 0}, 0.02, {0.8, 2, 0.8}}), HasSubstr("ball: albedo must be above 0"));
}

TEST(MarkerBody, TextRoundTripsExactly) {
  MarkerBody b = body();
  b.tag_family = "tagStandard41h12";
  b.faces[0].body_face = {Quat::about(normalized(Vec3d{1, 2, 3}), 0.7), {1.0 / 3, -2.0 / 7, 1e-17}};
  b.faces[0].outline[2] = {std::nextafter(0.03, 1), 0.1 / 3};
  b.faces[0].patches[0].albedo = {1.0 / 3, 0.2, 0.123456789012345678};
  b.ball = MarkerBall{{0.1 / 3, -1e-9, std::nextafter(1.0, 2)}, std::nextafter(0.02, 0), {0.8, 0.8, 0.8}};
  const Result<MarkerBody> back = parse_marker_body(marker_body_to_text(b), "x");
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(*back, b);
  EXPECT_EQ(marker_body_to_text(*back), marker_body_to_text(b));
}

TEST(MarkerBody, TextMayGiveOneAlbedoForAllChannelsAndARotationOfAnyLength) {
  const auto b = parse_marker_body(
      "tag_family: \"tag36h11\" tag_size_m: 0.024 face { tag_id: 1 pose { qx: 3 qw: 4 }\n"
      "outline_m: [0, 0, 1, 0, 0, 1]\n"
      "patch { outline_m: [0, 0, 1, 0, 0, 1] albedo: 0.5 }\n"
      "patch { outline_m: [0, 0, 1, 0, 0, 1] albedo: [0.1, 0.2, 0.3] } }",
      "x");
  ASSERT_TRUE(b.ok()) << b.status().message();
  EXPECT_EQ(b->faces[0].body_face.rotation, (Quat{0.6, 0, 0, 0.8}));
  EXPECT_EQ(b->faces[0].patches[0].albedo, (std::array{0.5, 0.5, 0.5}));
  EXPECT_EQ(b->faces[0].patches[1].albedo, (std::array{0.1, 0.2, 0.3}));
  EXPECT_FALSE(b->ball);
}

TEST(MarkerBody, InvalidTextIsReportedWithFileAndPosition) {
  EXPECT_TRUE(parse_marker_body(text_with(""), "x").ok());
  EXPECT_THAT(refusal_of_text(text_with("  outlin_m: 3\n")),
              testing::AllOf(StartsWith("cube.textproto:7:"), HasSubstr("did you mean 'outline_m'?")));
  EXPECT_THAT(refusal_of_text(text_with("", "bal { radius_m: 1 }")), HasSubstr("did you mean 'ball'?"));
  EXPECT_THAT(refusal_of_text(text_with("  patch { albdo: 1 }\n")), HasSubstr("did you mean 'albedo'?"));
  EXPECT_THAT(refusal_of_text(text_with("  outline_m: 3\n")),
              HasSubstr("face of tag 3: outline_m has an odd number of numbers"));
  EXPECT_THAT(refusal_of_text(text_with("  patch { outline_m: [0, 0, 1] albedo: 1 }\n")),
              HasSubstr("patch 0: outline_m has an odd"));
  EXPECT_THAT(refusal_of_text(text_with("  patch { outline_m: [0, 0, 1, 0, 0, 1] albedo: [1, 1] }\n")),
              HasSubstr("patch 0: albedo is one number, or r, g, b"));
  EXPECT_THAT(refusal_of_text(text_with("  patch { outline_m: [0, 0, 1, 0, 0, 1] }\n")),
              HasSubstr("patch 0: albedo is one number"));
  EXPECT_THAT(refusal_of_text(text_with("", "ball { center_m: [0, 0] radius_m: 1 albedo: 1 }")),
              HasSubstr("ball: center_m is x, y, z"));
  EXPECT_THAT(refusal_of_text(text_with("", "ball { center_m: [0, 0, 0] radius_m: 1 }")),
              HasSubstr("ball: albedo is one number"));
  EXPECT_THAT(refusal_of_text("face { tag_id: 4294967295 }"), StartsWith("cube.textproto: "));
  EXPECT_THAT(refusal_of_text(""), HasSubstr("tag_family: ''"));
  EXPECT_THAT(refusal_of_text("tag_family: \"tag36h11\" tag_size_m: 1"), HasSubstr("no face"));
}

TEST(MarkerBody, LoadsFilesAndNamesMissingOnes) {
  EXPECT_THAT(load_marker_body("/nonexistent.textproto").status().message(), StartsWith("/nonexistent.textproto: "));
  const test::TempDir folder;
  const auto loaded = load_marker_body(folder.write("body.textproto", marker_body_to_text(body())));
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(*loaded, body());
}

}  // namespace
}  // namespace lightwell
