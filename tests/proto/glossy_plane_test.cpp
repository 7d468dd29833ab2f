// Validation of glossy planes, and round trip through text.
#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/glossy_plane.hpp>

#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// A book with a tag at each side of it.
GlossyPlane plane() {
  GlossyPlane out;
  out.name = "book";
  out.side_m = 0.2;
  out.tag_size_m = 0.03;
  out.tags = {{7, {{0, 0, 0, 1}, {-0.13, 0, 0}}}, {9, {Quat::about({0, 0, 1}, 0.3), {0.13, 0.1 + 0.2, 0}}}};
  out.white_albedo = 0.85;
  return out;
}

/// The error message for a valid plane modified by `spoil`.
template <class Spoil>
std::string refusal(Spoil spoil) {
  GlossyPlane p = plane();
  spoil(p);
  const Status s = p.validate();
  EXPECT_EQ(s.code(), StatusCode::invalid_argument);
  return s.message();
}

std::string refusal_of_text(const std::string& text) {
  const Result<GlossyPlane> p = parse_glossy_plane(text, "book.textproto");
  EXPECT_FALSE(p.ok()) << text;
  return p ? "" : p.status().message();
}

TEST(GlossyPlane, ValidPlanePasses) {
  EXPECT_TRUE(plane().validate().ok()) << plane().validate().message();
  GlossyPlane unknown_white = plane();
  unknown_white.white_albedo.reset();
  EXPECT_TRUE(unknown_white.validate().ok());
  GlossyPlane limits = plane();
  limits.side_m = 10, limits.white_albedo = 0.05;
  EXPECT_TRUE(limits.validate().ok());
  limits.side_m = 0.01, limits.white_albedo = 0.95;
  EXPECT_TRUE(limits.validate().ok());
}

TEST(GlossyPlane, SizesAndFamilyAreChecked) {
  for (const double side : {0.0, -0.2, 0.0099, 10.1, kNan, kInf})
    EXPECT_THAT(refusal([&](GlossyPlane& p) { p.side_m = side; }), HasSubstr("side_m must be 0.01 to 10")) << side;
  for (const double size : {0.0, -0.03, kNan, kInf})
    EXPECT_THAT(refusal([&](GlossyPlane& p) { p.tag_size_m = size; }),
                HasSubstr("tag_size_m must be positive and finite"))
        << size;
  EXPECT_THAT(refusal([](GlossyPlane& p) { p.tag_family = "tag16h5"; }), HasSubstr("'tag16h5' is not known"));
  for (const double albedo : {0.0, 0.049, 0.951, -1.0, kNan, kInf})
    EXPECT_THAT(refusal([&](GlossyPlane& p) { p.white_albedo = albedo; }),
                HasSubstr("white_albedo must be 0.05 to 0.95"))
        << albedo;
}

TEST(GlossyPlane, TagsAreChecked) {
  EXPECT_THAT(refusal([](GlossyPlane& p) { p.tags.clear(); }), HasSubstr("at least one"));
  EXPECT_THAT(refusal([](GlossyPlane& p) {
                for (int k = 0; k < 63; ++k) p.tags.push_back({100 + k, {}});
              }),
              HasSubstr("more than 64"));
  EXPECT_THAT(refusal([](GlossyPlane& p) { p.tags[1].tag_id = 7; }), HasSubstr("tag 7: occurs twice"));
  EXPECT_THAT(refusal([](GlossyPlane& p) { p.tags[1].tag_id = -1; }), HasSubstr("tag_id must not be negative"));
  for (const Quat& rotation : {Quat{0, 0, 0, 0}, Quat{kNan, 0, 0, 1}, Quat{0, kInf, 0, 1}})
    EXPECT_THAT(refusal([&](GlossyPlane& p) { p.tags[1].plane_tag.rotation = rotation; }), HasSubstr("tag 9: "));
  EXPECT_THAT(refusal([](GlossyPlane& p) { p.tags[0].plane_tag.translation.y = kNan; }), HasSubstr("tag 7: "));
}

TEST(GlossyPlane, TheBodyHasAFaceForEachTag) {
  const GlossyPlane p = plane();
  const MarkerBody body = p.body();
  EXPECT_TRUE(body.validate().ok()) << body.validate().message();
  EXPECT_EQ(body.name, "book");
  EXPECT_EQ(body.tag_family, p.tag_family);
  EXPECT_EQ(body.tag_size_m, 0.03);
  ASSERT_EQ(body.faces.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(body.faces[k].tag_id, p.tags[k].tag_id);
    EXPECT_EQ(body.faces[k].body_face, p.tags[k].plane_tag);
    EXPECT_TRUE(body.faces[k].patches.empty());
    EXPECT_EQ(body.faces[k].outline.size(), 4U);
  }
  EXPECT_FALSE(body.ball.has_value());
}

TEST(GlossyPlane, RoundTripsThroughText) {
  for (const bool white_is_known : {true, false}) {
    GlossyPlane p = plane();
    if (!white_is_known) p.white_albedo.reset();
    const Result<GlossyPlane> read = parse_glossy_plane(glossy_plane_to_text(p), "book.textproto");
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(*read, p) << "exactly";
  }
}

TEST(GlossyPlane, RotationsAreNormalised) {
  const auto read = parse_glossy_plane(
      "side_m: 0.2 tag_family: \"tag36h11\" tag_size_m: 0.03 tag { tag_id: 1 pose { qz: 2 qw: 2 } }", "book.textproto");
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_NEAR(read->tags[0].plane_tag.rotation.w, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(read->tags[0].plane_tag.rotation.z, std::sqrt(0.5), 1e-15);
}

TEST(GlossyPlane, TextErrorsNameFileAndField) {
  EXPECT_THAT(refusal_of_text(""), HasSubstr("book.textproto: side_m"));
  EXPECT_THAT(refusal_of_text("side_m: 0.2\nside: 3"), HasSubstr("book.textproto:2:"));
  EXPECT_THAT(refusal_of_text("side_m: 0.2 tag_family: \"tag36h11\" tag_size_m: 0.03"), HasSubstr("at least one"));
  EXPECT_THAT(refusal_of_text("side_m: 0.2 tag_family: \"tag36h11\" tag_size_m: 0.03 tag { tag_id: 4294967295 pose { "
                              "qw: 1 } }"),
              HasSubstr("must not be negative"));
  EXPECT_THAT(refusal_of_text("side_m: 0.2 tag_family: \"tag36h11\" tag_size_m: 0.03 tag { tag_id: 1 }"),
              HasSubstr("tag 1"));
  EXPECT_THAT(refusal_of_text("side_m: nan"), HasSubstr("side_m"));
}

TEST(GlossyPlane, LoadsAFile) {
  const test::TempDir folder;
  const Result<GlossyPlane> read = load_glossy_plane(folder.write("book.textproto", glossy_plane_to_text(plane())));
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(*read, plane());
  const std::string wrong = folder.write("wrong.textproto", "side_m: 0.2\nside: 3");
  EXPECT_THAT(load_glossy_plane(wrong).status().message(), HasSubstr(wrong + ":2:"));
  EXPECT_EQ(load_glossy_plane("/nonexistent/book.textproto").status().code(), StatusCode::not_found);
}

}  // namespace
}  // namespace lightwell
