// Marker bodies: geometry of the solids, layout of their faces, and the body files.
#include "pose/marker_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightwell {
namespace {

using testing::HasSubstr;

constexpr double kDeg = std::numbers::pi / 180;

struct Solid {
  const char* name;
  Result<MarkerBody> (*make)(const SolidOptions&);
  std::size_t faces;
  double dihedral_rad;  ///< Interior angle between neighbouring faces.
  double edge;          ///< Edge length for a distance of 1 between opposite faces.
  std::size_t corner;   ///< Number of faces that meet in a corner.
};

/// Coxeter, Regular Polytopes, table I; edge lengths from the inradii.
const std::vector<Solid> kSolids = {{"cube", make_cube, 6, 90 * kDeg, 1, 3},
                                    {"dodecahedron", make_dodecahedron, 12, std::acos(-1 / std::sqrt(5.0)),
                                     1 / std::sqrt(2.5 + 1.1 * std::sqrt(5.0)), 3},
                                    {"icosahedron", make_icosahedron, 20, std::acos(-std::sqrt(5.0) / 3),
                                     6 / (3 * std::sqrt(3.0) + std::sqrt(15.0)), 5}};

Vec3d axis(const MarkerFace& face, Vec3d of_face) { return rotate(face.body_face.rotation, of_face); }
Vec3d normal(const MarkerFace& face) { return axis(face, {0, 0, 1}); }
Vec3d in_body(const MarkerFace& face, FacePoint p) { return transformed(face.body_face, Vec3d{p.x, p.y, 0}); }

double area(const FaceOutline& o) {
  double twice = 0;
  for (std::size_t i = 2; i < o.size(); ++i)
    twice += (o[i - 1].x - o[0].x) * (o[i].y - o[0].y) - (o[i - 1].y - o[0].y) * (o[i].x - o[0].x);
  return twice / 2;
}

/// Whether `p` is inside and further than `margin` from every edge.
bool inside(const FaceOutline& o, FacePoint p, double margin) {
  for (std::size_t i = 0; i < o.size(); ++i) {
    const FacePoint a = o[i], b = o[(i + 1) % o.size()];
    const double distance = ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)) / std::hypot(b.x - a.x, b.y - a.y);
    if (distance <= margin) return false;
  }
  return true;
}

FacePoint middle(const FaceOutline& o) {
  FacePoint out;
  for (const FacePoint& p : o)
    out.x += p.x / static_cast<double>(o.size()), out.y += p.y / static_cast<double>(o.size());
  return out;
}

class Solids : public testing::TestWithParam<Solid> {
 protected:
  static MarkerBody made(const SolidOptions& options = {}) {
    const Result<MarkerBody> body = GetParam().make(options);
    EXPECT_TRUE(body.ok()) << body.status().message();
    return body ? *body : MarkerBody();
  }
};

INSTANTIATE_TEST_SUITE_P(All, Solids, testing::ValuesIn(kSolids),
                         [](const auto& p) { return std::string(p.param.name); });

TEST_P(Solids, NeighbouringFacesMeetAtTheDihedralAngle) {
  const MarkerBody body = made();
  ASSERT_EQ(body.faces.size(), GetParam().faces);
  for (const MarkerFace& a : body.faces) {
    std::size_t neighbours = 0;
    double nearest = 4;
    for (const MarkerFace& b : body.faces)
      if (&a != &b) nearest = std::min(nearest, angle_between(normal(a), normal(b)));
    EXPECT_NEAR(nearest, std::numbers::pi - GetParam().dihedral_rad, 1e-12) << a.tag_id;
    for (const MarkerFace& b : body.faces)
      if (&a != &b && angle_between(normal(a), normal(b)) < nearest + 1e-9) ++neighbours;
    EXPECT_EQ(neighbours, a.outline.size()) << "one edge per neighbour";
  }
}

TEST(Dodecahedron, FacesMeetAt116565Degrees) {
  const auto body = make_dodecahedron();
  EXPECT_NEAR(180 - angle_between(normal(body->faces[0]), normal(body->faces[1])) / kDeg, 116.565, 5e-4);
}

TEST_P(Solids, NeighbouringFacesShareTheirCorners) {
  const MarkerBody body = made();
  std::vector<Vec3d> corners;
  for (const MarkerFace& face : body.faces)
    for (const FacePoint& p : face.outline) corners.push_back(in_body(face, p));
  for (const Vec3d& corner : corners) {
    EXPECT_EQ(std::count_if(corners.begin(), corners.end(), [&](Vec3d c) { return length(c - corner) < 1e-9; }),
              static_cast<std::ptrdiff_t>(GetParam().corner));
    EXPECT_EQ(std::count_if(corners.begin(), corners.end(), [&](Vec3d c) { return length(c - corner) < 1e-4; }),
              static_cast<std::ptrdiff_t>(GetParam().corner))
        << "no other corner nearby";
  }
}

TEST_P(Solids, AllEdgesHaveTheTheoreticalLength) {
  SolidOptions options;
  options.size_m = 0.073;
  const MarkerBody body = made(options);
  for (const MarkerFace& face : body.faces)
    for (std::size_t i = 0; i < face.outline.size(); ++i) {
      const FacePoint p = face.outline[i], q = face.outline[(i + 1) % face.outline.size()];
      EXPECT_NEAR(std::hypot(p.x - q.x, p.y - q.y), 0.073 * GetParam().edge, 1e-11);
    }
}

TEST_P(Solids, OppositeFacesAreParallelAndTheSizeApart) {
  SolidOptions options;
  options.size_m = 0.0815;
  const MarkerBody body = made(options);
  for (const MarkerFace& a : body.faces) {
    EXPECT_NEAR(dot(a.body_face.translation, normal(a)), 0.0815 / 2, 1e-11) << "normals point outwards";
    EXPECT_NEAR(length(a.body_face.translation), 0.0815 / 2, 1e-11) << "the tag is in the face's middle";
    const auto opposite = std::find_if(body.faces.begin(), body.faces.end(),
                                       [&](const MarkerFace& b) { return length(normal(a) + normal(b)) < 1e-12; });
    ASSERT_NE(opposite, body.faces.end());
    EXPECT_NEAR(dot(a.body_face.translation - opposite->body_face.translation, normal(a)), 0.0815, 1e-11);
  }
}

TEST_P(Solids, FacesAreNumberedFromTheTopRingByRing) {
  SolidOptions options;
  options.first_id = 40;
  const MarkerBody body = made(options);
  const std::size_t last = body.faces.size() - 1;
  EXPECT_LT(length(normal(body.faces[0]) - Vec3d{0, 1, 0}), 1e-12);
  EXPECT_LT(length(normal(body.faces[last]) - Vec3d{0, -1, 0}), 1e-12);
  EXPECT_LT(std::abs(normal(body.faces[1]).x), 1e-12) << "face 1 faces +Z";
  EXPECT_GT(normal(body.faces[1]).z, 0.5);
  for (std::size_t i = 0; i <= last; ++i) EXPECT_EQ(body.faces[i].tag_id, 40 + static_cast<int>(i));
  const auto azimuth = [](Vec3d n) {
    const double a = std::atan2(n.x, n.z);
    return a < -1e-9 ? a + 2 * std::numbers::pi : a;
  };
  for (std::size_t i = 1; 2 * i < last; ++i) {
    const Vec3d here = normal(body.faces[i]), next = normal(body.faces[i + 1]);
    if (next.y > -1e-9 && std::abs(here.y - next.y) < 1e-9) {
      EXPECT_LT(azimuth(here), azimuth(next)) << i;
    } else {
      EXPECT_LT(next.y, here.y) << i;
    }
  }
}

TEST(Dodecahedron, FaceNormalsAreAsDocumented) {
  const auto body = make_dodecahedron();
  for (std::size_t k = 0; k < 5; ++k) {
    const Vec3d n = normal(body->faces[1 + k]);
    EXPECT_NEAR(std::asin(n.y) / kDeg, 26.565, 5e-4);
    const double azimuth = 72 * static_cast<double>(k) * kDeg;
    EXPECT_LT(length(n - Vec3d{std::sin(azimuth) * 2, 1, std::cos(azimuth) * 2} * (1 / std::sqrt(5.0))), 1e-12);
    EXPECT_LT(length(n + normal(body->faces[6 + k])), 1e-12) << "face 6 + k is opposite to 1 + k";
  }
}

TEST(Icosahedron, TheLowerHalfIsOppositeInTheSameOrder) {
  const auto body = make_icosahedron();
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_LT(length(normal(body->faces[10 + k]) + normal(body->faces[4 + k])), 1e-12);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_LT(length(normal(body->faces[16 + k]) + normal(body->faces[1 + k])), 1e-12);
}

TEST_P(Solids, TagsStandUprightAsFarAsTheFaceAllows) {
  const MarkerBody body = made();
  const double symmetry = 2 * std::numbers::pi / static_cast<double>(body.faces[0].outline.size());
  for (std::size_t i = 0; i < body.faces.size(); ++i) {
    const MarkerFace& face = body.faces[i];
    const Vec3d up = axis(face, {0, 1, 0}), right = axis(face, {1, 0, 0});
    EXPECT_LT(length(cross(right, up) - normal(face)), 1e-12) << "right-handed, seen from outside";
    const Vec3d wanted = i == 0 ? Vec3d{0, 0, -1} : i + 1 == body.faces.size() ? Vec3d{0, 0, 1} : Vec3d{0, 1, 0};
    const Vec3d best = normalized(wanted - normal(face) * dot(wanted, normal(face)));
    EXPECT_LE(angle_between(up, best), symmetry / 4 + 1e-9) << "there is always an axis within this angle";
    for (const FacePoint& p : face.outline)
      EXPECT_TRUE(std::any_of(face.outline.begin(), face.outline.end(), [&](FacePoint q) {
        return std::abs(p.x + q.x) < 1e-9 && std::abs(p.y - q.y) < 1e-9;
      })) << "left and right are mirror images";
    if (std::string(GetParam().name) != "icosahedron") {
      EXPECT_LT(angle_between(up, best), 1e-9);
    }
  }
}

TEST_P(Solids, PatchesAndTheWhiteSquareTileTheFace) {
  for (const PaperKind kind : {PaperKind::white, PaperKind::grey})
    for (const TagFamily family : {TagFamily::tag36h11, TagFamily::tagStandard41h12}) {
      SolidOptions options;
      options.paper = kind;
      options.family = family;
      const MarkerBody body = made(options);
      const double side = white_square_m(family, body.tag_size_m), h = side / 2;
      const FaceOutline square = {{-h, -h}, {h, -h}, {h, h}, {-h, h}};
      std::mt19937 random(1);
      for (const MarkerFace& face : body.faces) {
        double sum = side * side;
        for (const MarkerPatch& patch : face.patches) sum += area(patch.outline);
        // Coordinates are rounded to a picometre.
        EXPECT_NEAR(sum, area(face.outline), 1e-12 * 0.1 * 8) << face.tag_id;
        for (int i = 0; i < 200; ++i) {
          std::uniform_real_distribution<double> range(-0.06, 0.06);
          const FacePoint p{range(random), range(random)};
          const auto holds = [&](const FaceOutline& o) { return inside(o, p, 1e-9); };
          const auto by_patches = std::count_if(face.patches.begin(), face.patches.end(),
                                                [&](const MarkerPatch& m) { return holds(m.outline); });
          EXPECT_EQ(by_patches + holds(square), holds(face.outline) ? 1 : 0) << "every point in exactly one part";
        }
      }
    }
}

TEST_P(Solids, QuadrantsHaveTheirAlbedos) {
  for (const PaperKind kind : {PaperKind::white, PaperKind::grey}) {
    SolidOptions options;
    options.paper = kind;
    for (const MarkerFace& face : made(options).faces) {
      std::array<int, 4> seen{};
      for (const MarkerPatch& patch : face.patches) {
        const FacePoint m = middle(patch.outline);
        const std::size_t quadrant = (m.y > 0 ? 0U : 2U) + (m.x > 0 ? 1U : 0U);
        ++seen[quadrant];
        const double grey = std::array{0.80, 0.60, 0.40, 0.20}[quadrant];
        const double wanted = kind == PaperKind::grey ? grey : 0.80;
        EXPECT_EQ(patch.albedo, (std::array{wanted, wanted, wanted}));
        for (const FacePoint& p : patch.outline) EXPECT_TRUE(p.x * m.x >= 0 && p.y * m.y >= 0) << "within its quadrant";
      }
      EXPECT_THAT(seen, testing::Each(2));
    }
  }
}

TEST_P(Solids, TextRoundTripIsExact) {
  const MarkerBody body = made();
  const auto back = parse_marker_body(marker_body_to_text(body), "x");
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(*back, body);
}

TEST_P(Solids, RejectsInvalidOptionsWithTheRemedy) {
  const auto refusal = [](const SolidOptions& options) {
    const auto body = GetParam().make(options);
    EXPECT_EQ(body.status().code(), StatusCode::invalid_argument);
    return body.status().message();
  };
  for (const double size : {0.0, -0.1, 11.0, std::nan("")}) {
    SolidOptions options;
    options.size_m = size;
    EXPECT_THAT(refusal(options), HasSubstr("size_m is "));
  }
  SolidOptions small;
  small.size_m = 0.001;
  EXPECT_THAT(refusal(small), HasSubstr("too small for a tag with cells of 0.1 mm"));
  SolidOptions numbers;
  numbers.first_id = 587 - static_cast<int>(GetParam().faces) + 1;
  EXPECT_THAT(refusal(numbers), HasSubstr("tag36h11 has numbers 0 to 586"));
  --numbers.first_id;
  EXPECT_TRUE(GetParam().make(numbers).ok()) << "the largest valid first_id";
  numbers.first_id = -1;
  EXPECT_THAT(refusal(numbers), HasSubstr("first_id is -1"));
  SolidOptions tag;
  tag.tag_size_m = 0.09;
  const std::string message = refusal(tag);
  ASSERT_THAT(message, HasSubstr("tag_size_m is 0.09; on this face it is above 0 and at most "));
  const double most = std::stod(message.substr(message.rfind(' ')));
  tag.tag_size_m = most * 1.0001;
  (void)refusal(tag);
  tag.tag_size_m = most * 0.9999;
  EXPECT_TRUE(GetParam().make(tag).ok()) << "the limit in the message must be valid";
  tag.tag_size_m = -0.01;
  (void)refusal(tag);
}

TEST(MarkerBodies, DefaultTagSizes) {
  EXPECT_DOUBLE_EQ(make_dodecahedron()->tag_size_m, 0.024) << "cells of 3 mm, a white square of 30 mm";
  EXPECT_DOUBLE_EQ(white_square_m(TagFamily::tag36h11, 0.024), 0.030);
  SolidOptions cube;
  cube.size_m = 0.06;
  EXPECT_DOUBLE_EQ(make_cube(cube)->tag_size_m, 0.024);
  EXPECT_DOUBLE_EQ(make_icosahedron()->tag_size_m, 0.0152);
  EXPECT_DOUBLE_EQ(make_ball_on_tag()->tag_size_m, 0.024);
  EXPECT_DOUBLE_EQ(white_square_m(TagFamily::tagStandard41h12, 0.015), 0.033)
      << "nine cells, and one of rim on each side";
  EXPECT_EQ(tag_size_for(TagFamily::tag36h11, 0.0009), 0);
}

TEST(BallOnTag, TheBallTouchesTheSheetOneDiameterBehindTheTag) {
  BallOnTagOptions options;
  options.ball_diameter_m = 0.05;
  options.ball_albedo = 0.7;
  options.id = 17;
  const auto body = make_ball_on_tag(options);
  ASSERT_TRUE(body.ok()) << body.status().message();
  ASSERT_EQ(body->faces.size(), 1U);
  ASSERT_TRUE(body->ball);
  const MarkerFace& sheet = body->faces[0];
  EXPECT_EQ(sheet.tag_id, 17);
  EXPECT_EQ(body->ball->center, Vec3d{}) << "the origin is the ball's centre";
  EXPECT_EQ(body->ball->albedo, (std::array{0.7, 0.7, 0.7}));
  EXPECT_LT(length(normal(sheet) - Vec3d{0, 1, 0}), 1e-12);
  EXPECT_LT(length(axis(sheet, {0, 1, 0}) - Vec3d{0, 0, -1}), 1e-12);
  const Vec3d ball = transformed(inverse(sheet.body_face), body->ball->center);
  EXPECT_LT(length(ball - Vec3d{0, 0.05, 0.025}), 1e-12) << "the ball touches the sheet's plane";
  EXPECT_TRUE(inside(sheet.outline, {0, 0.05}, 0.025)) << "the whole ball is above the sheet";
  EXPECT_NEAR(area(sheet.outline), 0.125 * 0.125, 1e-12);
}

TEST(BallOnTag, NoPatchLiesBeneathTheBall) {
  for (const PaperKind kind : {PaperKind::white, PaperKind::grey}) {
    BallOnTagOptions options;
    options.paper = kind;
    const auto body = make_ball_on_tag(options);
    EXPECT_EQ(body->faces[0].patches.size(), 6U);
    for (const MarkerPatch& patch : body->faces[0].patches)
      for (const FacePoint& p : patch.outline) {
        EXPECT_LE(p.y, white_square_m(TagFamily::tag36h11, body->tag_size_m) / 2 + 1e-12);
        EXPECT_LT(p.y, 0.04 - 0.02) << "the edge of the ball, seen from above";
      }
    EXPECT_EQ(*parse_marker_body(marker_body_to_text(*body), "x"), *body);
  }
  BallOnTagOptions wrong;
  wrong.tag_size_m = 0.03;
  EXPECT_THAT(make_ball_on_tag(wrong).status().message(), HasSubstr("at most 0.0288"));
  wrong = {};
  wrong.ball_diameter_m = 0;
  EXPECT_THAT(make_ball_on_tag(wrong).status().message(), HasSubstr("ball_diameter_m is 0"));
  wrong = {};
  wrong.ball_albedo = 1.2;
  EXPECT_THAT(make_ball_on_tag(wrong).status().message(), HasSubstr("ball: albedo"));
  wrong = {};
  wrong.id = 587;
  EXPECT_THAT(make_ball_on_tag(wrong).status().message(), HasSubstr("tag36h11 has numbers 0 to 586"));
}

TEST(MarkerBodies, PaperKindNamesRoundTrip) {
  for (const PaperKind kind : {PaperKind::white, PaperKind::grey}) EXPECT_EQ(*parse_paper_kind(to_string(kind)), kind);
  EXPECT_THAT(parse_paper_kind("gray").status().message(), HasSubstr("known are white and grey"));
}

/// Equal except for rounding errors of the math library of another processor.
void expect_same(const MarkerBody& file, const MarkerBody& made) {
  EXPECT_EQ(file.name, made.name);
  EXPECT_EQ(file.tag_family, made.tag_family);
  EXPECT_DOUBLE_EQ(file.tag_size_m, made.tag_size_m);
  EXPECT_EQ(file.ball, made.ball);
  ASSERT_EQ(file.faces.size(), made.faces.size());
  const auto same_outline = [](const FaceOutline& a, const FaceOutline& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_NEAR(a[i].x, b[i].x, 2e-12);
      EXPECT_NEAR(a[i].y, b[i].y, 2e-12);
    }
  };
  for (std::size_t i = 0; i < file.faces.size(); ++i) {
    const MarkerFace &a = file.faces[i], &b = made.faces[i];
    EXPECT_EQ(a.tag_id, b.tag_id);
    EXPECT_LT(length(a.body_face.translation - b.body_face.translation), 4e-12);
    for (const Vec3d v : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}}) EXPECT_LT(length(axis(a, v) - axis(b, v)), 1e-12);
    same_outline(a.outline, b.outline);
    ASSERT_EQ(a.patches.size(), b.patches.size());
    for (std::size_t k = 0; k < a.patches.size(); ++k) {
      same_outline(a.patches[k].outline, b.patches[k].outline);
      EXPECT_EQ(a.patches[k].albedo, b.patches[k].albedo);
    }
  }
}

TEST(MarkerBodies, BodyFilesMatchTheGeneratedBodies) {
  const auto file = [](const std::string& name) {
    const auto body = load_marker_body(std::string(LIGHTWELL_MARKER_BODIES) + "/" + name + ".textproto");
    EXPECT_TRUE(body.ok()) << body.status().message();
    return body ? *body : MarkerBody();
  };
  SolidOptions options;
  expect_same(file("dodecahedron_100mm_white"), *make_dodecahedron(options));
  expect_same(file("icosahedron_100mm_white"), *make_icosahedron(options));
  options.paper = PaperKind::grey;
  expect_same(file("dodecahedron_100mm_grey"), *make_dodecahedron(options));
  options.size_m = 0.06;
  expect_same(file("cube_60mm_grey"), *make_cube(options));
  expect_same(file("ball_40mm"), *make_ball_on_tag());
}

}  // namespace
}  // namespace lightwell
