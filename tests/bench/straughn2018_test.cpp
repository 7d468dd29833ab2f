// Each rule of the thesis with a case computed by hand. The camera is 200x100 with a focal length of 100 px and its
// axis through the image centre: a point x to the right and y up at distance z is in column floor(100 + 100 x/z) and
// row floor(50 - 100 y/z).
#include "bench/straughn2018.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "bench/straughn2018_published.hpp"

namespace lightwell::bench {
namespace {

constexpr int kWidth = 200, kHeight = 100;
constexpr StraughnCamera kCamera{kWidth, kHeight, 100, 100, 99.5, 49.5};
constexpr double kTag = 0.2;
/// Pose of an upright face towards the camera: its up is the camera's up, its normal points back to the camera.
constexpr Quat kFacing{1, 0, 0, 0};

struct Picture {
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(3 * kWidth * kHeight, 0);

  void set(int x, int y, std::array<std::uint8_t, 3> rgb) {
    for (std::size_t c = 0; c < 3; ++c) bytes[static_cast<std::size_t>(3 * (y * kWidth + x)) + c] = rgb[c];
  }
  [[nodiscard]] StraughnPicture picture() const { return {kWidth, kHeight, 3, bytes, 3 * kWidth}; }
};

StraughnTag tag_at(int id, const Pose& camera_face) {
  StraughnTag tag{id, {}};
  const std::array<FacePoint, 4> corners{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3d p = transformed(camera_face, Vec3d{corners[k].x, corners[k].y, 0} * (kTag / 2));
    tag.corners_px[k] = {kCamera.fx * p.x / p.z + kCamera.cx, kCamera.fy * p.y / p.z + kCamera.cy};
  }
  return tag;
}

/// A face at the body's origin without rotation.
StraughnFace plain_face(int tag_id, std::vector<StraughnPoint> points) { return {tag_id, {}, std::move(points), {}}; }

void expect_near(Vec3d a, Vec3d b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

// --- 3.2.2: poses ---

TEST(StraughnPose, ATagAtOneMetreGivesThatPose) {
  // 0.1 m to each side at 1 m are 10 px from the image centre, (99.5, 49.5).
  const StraughnTag tag{0, {{{89.5, 59.5}, {109.5, 59.5}, {109.5, 39.5}, {89.5, 39.5}}}};
  const auto pose = straughn_face_pose(tag, kCamera, kTag);
  ASSERT_TRUE(pose);
  expect_near(pose->translation, {0, 0, 1}, 1e-6);
  expect_near(rotate(pose->rotation, Vec3d{1, 0, 0}), {1, 0, 0}, 1e-4);
  expect_near(rotate(pose->rotation, Vec3d{0, 1, 0}), {0, -1, 0}, 1e-4);
}

TEST(StraughnPose, ARotatedTagGivesItsPose) {
  const Pose truth{Quat::about({0, 1, 0}, 0.7) * kFacing, {0.1, -0.05, 0.8}};
  const auto pose = straughn_face_pose(tag_at(0, truth), kCamera, kTag);
  ASSERT_TRUE(pose);
  expect_near(pose->translation, truth.translation, 1e-6);
  for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    expect_near(rotate(pose->rotation, axis), rotate(truth.rotation, axis), 1e-6);
}

TEST(StraughnSample, IsEmptyWithoutTags) {
  const Picture picture;
  EXPECT_TRUE(straughn_sample(picture.picture(), kCamera, {kTag, {plain_face(0, {{{0, 0}, 1}})}}, {}).empty());
}

TEST(StraughnSample, TheLargestTagDeterminesTheBodysPose) {
  // Both tags are detected, face 0's at 1 m and face 1's at 2 m, which contradict each other. Face 2 is 0.5 m to the
  // right: by face 0 in column 100 + 100 (0.505 / 1), by face 1 in column 100 + 100 (0.505 / 2).
  StraughnMarker marker{
      kTag, {plain_face(0, {{{0, 0}, 1}}), plain_face(1, {{{0, 0}, 1}}), plain_face(2, {{{0.005, 0.005}, 1}})}};
  marker.faces[2].body_face.translation = {0.5, 0, 0};
  Picture picture;
  picture.set(150, 49, {255, 255, 255});
  const std::vector<StraughnTag> tags{tag_at(1, {kFacing, {0, 0, 2}}), tag_at(0, {kFacing, {0, 0, 1}})};
  const auto seen = straughn_sample(picture.picture(), kCamera, marker, tags);
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_TRUE(seen[0].direct);
  EXPECT_TRUE(seen[1].direct);
  EXPECT_FALSE(seen[2].direct);
  EXPECT_NEAR(seen[2].luminance, 1.03, 1e-9);
}

// --- 3.3: luminance ---

TEST(StraughnSample, AFacesLuminanceIsTheMeanOfItsPointsDividedByTheirMaximum) {
  // First point: column 100 + 10.5, row 50 - 20.5; 0.33 * 0.4 + 0.59 * 0.8 + 0.11 * 0.2 = 0.626; divided by 0.515:
  // 1.2155. Second: column 100 - 30.5, row 50 + 10.5; 1.03 * 0.2 = 0.206; divided by 1.03: 0.2. The third is outside.
  const StraughnMarker marker{kTag, {plain_face(7, {{{0.105, 0.205}, 0.515}, {{-0.305, -0.105}, 1.03}, {{2, 0}, 1}})}};
  Picture picture;
  picture.set(110, 29, {102, 204, 51});
  picture.set(69, 60, {51, 51, 51});
  const std::vector<StraughnTag> tags{tag_at(7, {kFacing, {0, 0, 1}})};
  const auto seen = straughn_sample(picture.picture(), kCamera, marker, tags);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_NEAR(seen[0].luminance, (0.626 / 0.515 + 0.2) / 2, 1e-9);
  expect_near(seen[0].normal_cv, {0, 0, -1}, 1e-4);
}

TEST(StraughnSample, AGreyImageEqualsOneWithThreeEqualChannels) {
  const StraughnMarker marker{kTag, {plain_face(7, {{{0.105, 0.205}, 1.03}})}};
  std::vector<std::uint8_t> grey(kWidth * kHeight, 0);
  grey[29 * kWidth + 110] = 153;
  const std::vector<StraughnTag> tags{tag_at(7, {kFacing, {0, 0, 1}})};
  const auto seen = straughn_sample({kWidth, kHeight, 1, grey, kWidth}, kCamera, marker, tags);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_NEAR(seen[0].luminance, 0.6, 1e-9);
}

/// Face 0 is detected at 1 m, the body's centre is 0.1 m behind it; face 1 is rotated by `turn`.
struct Projected {
  StraughnMarker marker;
  std::vector<StraughnTag> tags{tag_at(0, {kFacing, {0, 0, 1}})};

  explicit Projected(Quat turn) : marker{kTag, {plain_face(0, {{{0, 0}, 1}}), plain_face(1, {{{0, 0.00525}, 1.03}})}} {
    marker.faces[0].body_face = {{}, {0, 0, 0.1}};
    marker.faces[1].body_face = {turn, rotate(turn, Vec3d{0, 0, 0.1})};
  }
};

TEST(StraughnSample, AFaceWithoutADetectedTagIsSampledIfItFacesTheCamera) {
  // Rotated by 60 degrees to the right: normal (0.8660, 0, -0.5), centre (0.08660, 0, 1.1 - 0.05), from there to the
  // eye (-0.08660, 0, -1.05) / 1.05357: cosine (-0.075 + 0.525) / 1.05357 = 0.42712. Column 100 + 8.66025 / 1.05 =
  // 108.2, row 50 - 0.525 / 1.05 = 49.5.
  const Projected body(Quat::about({0, 1, 0}, std::acos(0.5)));
  Picture picture;
  picture.set(108, 49, {153, 153, 153});
  StraughnOptions options;
  options.visible_cosine = 0.427;
  const auto seen = straughn_sample(picture.picture(), kCamera, body.marker, body.tags, options);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[1].face, 1U);
  EXPECT_FALSE(seen[1].direct);
  EXPECT_NEAR(seen[1].luminance, 0.6, 1e-9);
  expect_near(seen[1].normal_cv, {std::sqrt(0.75), 0, -0.5}, 1e-4);
  options.visible_cosine = 0.4273;
  EXPECT_EQ(straughn_sample(picture.picture(), kCamera, body.marker, body.tags, options).size(), 1U);
}

TEST(StraughnSample, LiterallyThePerspectiveMatrixScalesNormals) {
  // Rotated down, sine 0.6: the normal is (0, 0.6, -0.8). 2 * 100 / 200 = 1 across, 2 * 100 / 100 = 2 down: (0, 1.2,
  // -0.8), of length 1.442221: (0, 0.832050, -0.554700), and the last number is the cosine with the axis.
  const Projected body(Quat::about({1, 0, 0}, std::asin(0.6)));
  const Picture picture;
  StraughnOptions options;
  expect_near(straughn_sample(picture.picture(), kCamera, body.marker, body.tags, options).at(1).normal_cv,
              {0, 0.6, -0.8}, 1e-4);
  options.normals = StraughnOptions::Normals::letter;
  options.visible_cosine = 0.554;
  expect_near(straughn_sample(picture.picture(), kCamera, body.marker, body.tags, options).at(1).normal_cv,
              {0, 0.832050, -0.554700}, 1e-4);
  options.visible_cosine = 0.555;
  EXPECT_EQ(straughn_sample(picture.picture(), kCamera, body.marker, body.tags, options).size(), 1U);
}

// --- the thesis's files ---

MarkerBody three_sides() {
  const auto square = [](double x, double y, double half, double albedo) {
    return MarkerPatch{{{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}},
                       {albedo, albedo, albedo}};
  };
  MarkerBody body;
  body.tag_size_m = 0.02;
  for (const double turn_deg : {0, 90, 180}) {
    MarkerFace face;
    face.tag_id = static_cast<int>(body.faces.size());
    face.body_face.rotation = Quat::about({0, 1, 0}, turn_deg * std::acos(-1.0) / 180);
    face.patches = {square(-0.02, 0.02, 0.005, 0.80), square(0.03, 0.01, 0.001, 0.80), square(0.02, 0.02, 0.005, 0.60),
                    square(-0.02, -0.02, 0.005, 0.40), square(0.02, -0.02, 0.005, 0.20)};
    body.faces.push_back(face);
  }
  return body;
}

TEST(StraughnMarker, PointsAreInTheQuadrantsAndHaveTheirRelativeAlbedo) {
  // The small patch at the top right is less deep than the other patch there.
  const StraughnMarker marker = straughn_marker(three_sides(), StraughnEncoding::linear, 1);
  ASSERT_EQ(marker.faces.size(), 3U);
  ASSERT_EQ(marker.faces[0].points.size(), 4U);
  double top_left = 0, top_right = 0, bottom_left = 0, bottom_right = 0;
  for (const StraughnPoint& p : marker.faces[0].points) {
    EXPECT_NEAR(std::abs(p.at.x), 0.02, 1e-12);
    EXPECT_NEAR(std::abs(p.at.y), 0.02, 1e-12);
    (p.at.y > 0 ? (p.at.x < 0 ? top_left : top_right) : (p.at.x < 0 ? bottom_left : bottom_right)) = p.max_luminance;
  }
  EXPECT_NEAR(top_left, 1.03, 1e-12);
  EXPECT_NEAR(top_right, 0.75 * 1.03, 1e-12);
  EXPECT_NEAR(bottom_left, 0.50 * 1.03, 1e-12);
  EXPECT_NEAR(bottom_right, 0.25 * 1.03, 1e-12);
}

TEST(StraughnMarker, TheReferenceImageHasTheEncodingOfTheImage) {
  // sRGB of 0.5: 1.055 * 0.5^(1 / 2.4) - 0.055 = 0.735357.
  const StraughnMarker marker = straughn_marker(three_sides(), StraughnEncoding::srgb, 1);
  int found = 0;
  for (const StraughnPoint& p : marker.faces[0].points)
    found += std::abs(p.max_luminance - 1.03 * 0.735357) < 1e-6 ? 1 : 0;
  EXPECT_EQ(found, 1);
}

TEST(StraughnMarker, SidesWithTheNearestNormalsAreAdjacent) {
  const StraughnMarker marker = straughn_marker(three_sides(), StraughnEncoding::linear, 1);
  EXPECT_EQ(marker.faces[0].adjacent, (std::vector<std::size_t>{1}));
  EXPECT_EQ(marker.faces[1].adjacent, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(marker.faces[2].adjacent, (std::vector<std::size_t>{1}));
}

// --- 3.4: the light. Directions are returned in axes y up, z back, so y and z change their signs. ---

/// Faces 0, 1 and 2; 0 and 1 are adjacent, and optionally 1 and 2.
StraughnMarker three_faces(bool second_pair = false) {
  StraughnMarker marker{kTag, {plain_face(0, {}), plain_face(1, {}), plain_face(2, {})}};
  marker.faces[0].adjacent = {1};
  marker.faces[1].adjacent = {0};
  if (second_pair) marker.faces[1].adjacent.push_back(2), marker.faces[2].adjacent = {1};
  return marker;
}
constexpr Vec3d kAhead{0, 0, -1}, kAside{0.6, 0, -0.8};

TEST(StraughnLight, LitFacesContributeTheirNormalTimesLuminance) {
  // 0.9 (0, 0, -1) + 0.5 (0, -0.6, -0.8) = (0, -0.3, -1.3), of length 1.334166. A face at the threshold is lit.
  const std::vector<StraughnView> seen{{0, true, kAhead, 0.9}, {1, true, {0, -0.6, -0.8}, 0.5}};
  const StraughnLight light = straughn_light(three_faces(), seen);
  ASSERT_TRUE(light.known);
  expect_near(light.direction, {0, 0.224860, 0.974392}, 1e-6);
  EXPECT_DOUBLE_EQ(light.intensity, 0.9);
  EXPECT_DOUBLE_EQ(light.ambient, 0.5);
}

TEST(StraughnLight, AShadowedFacesNormalIsReflectedAcrossItsLitNeighbour) {
  // 2 * 0.8 (0, 0, -1) - (0.6, 0, -0.8) = (-0.6, 0, -0.8). The darkest face has relative darkness 1:
  // 0.8 (0, 0, -1) + (-0.6, 0, -0.8) = (-0.6, 0, -1.6), of length 1.708801.
  const std::vector<StraughnView> seen{{0, true, kAhead, 0.8}, {1, true, kAside, 0.2}};
  const StraughnLight light = straughn_light(three_faces(), seen);
  ASSERT_TRUE(light.known);
  expect_near(light.direction, {-0.351124, 0, 0.936329}, 1e-6);
  EXPECT_DOUBLE_EQ(light.intensity, 0.8);
  EXPECT_DOUBLE_EQ(light.ambient, 0.2);
}

TEST(StraughnLight, WithoutALitNeighbourTheNormalIsReversedAndWeightedByDarkness) {
  // Ambient 0.1; face 1: 1 - (0.2 - 0.1) / (0.5 - 0.1) = 0.75; face 2: 1. 0.8 (0, 0, -1) + 0.75 (-0.6, 0, -0.8) + (0,
  // -1, 0) = (-0.45, -1, -1.4), of length 1.778342.
  const std::vector<StraughnView> seen{{0, true, kAhead, 0.8}, {1, true, kAside, 0.2}, {2, false, {0, 1, 0}, 0.1}};
  const StraughnLight light = straughn_light(three_faces(), seen);
  ASSERT_TRUE(light.known);
  expect_near(light.direction, {-0.253045, 0.562322, 0.787250}, 1e-6);
  EXPECT_DOUBLE_EQ(light.ambient, 0.1);
}

TEST(StraughnLight, ReflectionsAcrossTwoLitNeighboursAreAveragedAndNormalised) {
  // Across (0, 0, -1): (-0.6, 0, -0.8); across (0, -1, 0), which it is perpendicular to: (-0.6, 0, 0.8). Their mean
  // (-0.6, 0, 0) becomes (-1, 0, 0). 0.8 (0, 0, -1) + 0.6 (0, -1, 0) + (-1, 0, 0) = (-1, -0.6, -0.8), of
  // length 1.414214.
  const std::vector<StraughnView> seen{{0, true, kAhead, 0.8}, {2, true, {0, -1, 0}, 0.6}, {1, true, kAside, 0.2}};
  const StraughnLight light = straughn_light(three_faces(true), seen);
  ASSERT_TRUE(light.known);
  expect_near(light.direction, {-0.707107, 0.424264, 0.565685}, 1e-6);
}

TEST(StraughnLight, AmbientIsTheLowestLuminanceUnlessAboveOneHalf) {
  const StraughnMarker marker = three_faces();
  EXPECT_DOUBLE_EQ(
      straughn_light(marker, std::vector<StraughnView>{{0, true, kAhead, 0.8}, {1, true, kAside, 0.5}}).ambient, 0.5);
  EXPECT_DOUBLE_EQ(
      straughn_light(marker, std::vector<StraughnView>{{0, true, kAhead, 0.8}, {1, true, kAside, 0.51}}).ambient, 0.3);
}

TEST(StraughnLight, RelativeDarknessUsesTheDefaultAmbient) {
  // Ambient 0.3, because both are above 0.5. Face 1: 1 - (0.6 - 0.3) / (0.7 - 0.3) = 0.25.
  // 0.8 (0, 0, -1) + 0.25 (-0.6, 0, -0.8) = (-0.15, 0, -1), of length 1.011187.
  StraughnOptions options;
  options.threshold = 0.7;
  const std::vector<StraughnView> seen{{0, true, kAhead, 0.8}, {1, true, kAside, 0.6}};
  expect_near(straughn_light(three_faces(), seen, options).direction, {-0.148340, 0, 0.988936}, 1e-6);
}

TEST(StraughnLight, WithOnlyShadowedFacesTheLightIsOnTheOppositeSide) {
  const StraughnLight light = straughn_light(three_faces(), std::vector<StraughnView>{{0, true, kAhead, 0.2}});
  ASSERT_TRUE(light.known);
  expect_near(light.direction, {0, 0, -1}, 1e-12);
}

TEST(StraughnLight, NoFacesOrCancellingVectorsGiveNoLight) {
  EXPECT_FALSE(straughn_light(three_faces(), {}).known);
  EXPECT_FALSE(
      straughn_light(three_faces(), std::vector<StraughnView>{{0, true, kAhead, 0.8}, {2, true, -kAhead, 0.8}}).known);
}

TEST(StraughnThreshold, IsTheMiddleOfTheBestRange) {
  // Between 0.2 and 0.8 (52 to 204 of 256) the faces are separated, and the result is that of the reflected normal
  // above.
  const StraughnMarker marker = three_faces();
  const std::vector<StraughnCase> cases{
      {&marker, {{0, true, kAhead, 0.8}, {1, true, kAside, 0.2}}, normalized(Vec3d{-0.6, 0, 1.6})}};
  const auto best = straughn_best_threshold(cases);
  ASSERT_TRUE(best);
  EXPECT_DOUBLE_EQ(best->threshold, 0.5);
  EXPECT_NEAR(best->mean_error_rad, 0, 1e-7);
}

TEST(StraughnThreshold, FramesWithoutAnEstimateDoNotCount) {
  const StraughnMarker marker = three_faces();
  const std::vector<StraughnCase> none{{&marker, {}, {0, 0, 1}}};
  EXPECT_FALSE(straughn_best_threshold(none));
}

TEST(StraughnPublished, FiguresAreConsistent) {
  // The text also gives the mean in degrees; groups of four and of five of the twenty cases must have the same mean.
  EXPECT_NEAR(kStraughnMean.degrees(), 67.48, 0.01);
  EXPECT_NEAR(kStraughnMedian.degrees(), 60.01, 0.01);
  double by_lamp = 0, by_view = 0;
  for (const StraughnPublished& p : kStraughnByLamp) by_lamp += p.percent / kStraughnByLamp.size();
  for (const StraughnPublished& p : kStraughnByView) by_view += p.percent / kStraughnByView.size();
  EXPECT_NEAR(by_lamp, kStraughnMean.percent, 0.01);
  EXPECT_NEAR(by_view, kStraughnMean.percent, 0.01);
}

}  // namespace
}  // namespace lightwell::bench
