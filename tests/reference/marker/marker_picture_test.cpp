// Positions and radiances in images of a marker, compared with closed forms and with a tag detector.
#include "reference/marker/marker_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pose/tag_detector.hpp"
#include "reference/marker/marker_exposure.hpp"
#include "reference/marker/marker_stage.hpp"
#include "reference/marker/test_bodies.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

constexpr double kDegree = pi / 180;
/// Rounding of float images.
constexpr double kFloat = 1e-6;

MarkerBody body_file(const std::string& name) {
  const auto body = load_marker_body(std::string(LIGHTWELL_MARKER_BODIES) + "/" + name + ".textproto");
  EXPECT_TRUE(body) << body.status().message();
  return body ? *body : cube_by_hand();
}

/// A body on a table in uniform ambient light, with one lamp in front.
MarkerScene lit(const MarkerBody& body, const MarkerStage& stage, int bottom_tag) {
  MarkerScene scene;
  scene.body = body;
  scene.probe_body = stage.probe_body();
  scene.ambient = even_ambient({0.2, 0.2, 0.2});
  scene.lamps = {NearLamp{stage.place(30 * kDegree, 50 * kDegree, 0.6), {0.5, 0.5, 0.5}}};
  scene.table = table_under(body, scene.probe_body, bottom_tag, {0.15, 0.15, 0.15});
  return scene;
}

Rgb at_pixel(const RadiancePicture& picture, PixelPosition p) {
  return picture.at(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
}

TEST(MarkerPicture, TheCameraHasTheProbesAxes) {
  const MarkerCamera camera(pinhole_lens(641, 481, 500));
  const PixelPosition middle = camera.pixel_of({0, 0, -2}).value();
  EXPECT_NEAR(middle.x, 320, 1e-9);
  EXPECT_NEAR(middle.y, 240, 1e-9);
  // 500 px focal length: 0.1 of 1 m is 50 px.
  EXPECT_NEAR(camera.pixel_of({0.1, 0, -1}).value().x, 370, 1e-9);
  EXPECT_NEAR(camera.pixel_of({0, 0.1, -1}).value().y, 190, 1e-9);
  EXPECT_FALSE(camera.pixel_of({0, 0, 1}).has_value());
}

TEST(MarkerPicture, InterpolatedRaysMatchTheLensModel) {
  LensParameters fisheye = pinhole_lens(320, 240, 140);
  fisheye.model = KannalaBrandtParameters{140, 140, 160, 120, -0.02, 0.003, 0, 0};
  fisheye.max_angle_rad = 1.6;
  for (const LensParameters& lens : {pinhole_lens(320, 240, 300), fisheye}) {
    const MarkerCamera camera(lens);
    for (int x = 0; x < 320; x += 23)
      for (int y = 0; y < 240; y += 19) {
        const auto ray = camera.ray(x, y, 0.3, 0.8);
        ASSERT_TRUE(ray) << x << ' ' << y;
        const PixelPosition there = camera.pixel_of(*ray).value();
        // For the fisheye, 1 / (8 * 140) px.
        EXPECT_NEAR(there.x, x - 0.5 + 0.3, 2e-3);
        EXPECT_NEAR(there.y, y - 0.5 + 0.8, 2e-3);
      }
  }
}

TEST(MarkerPicture, APatchsPixelsHaveAlbedoOverPiOfItsIrradiance) {
  MarkerScene scene;
  scene.body = cube_by_hand();
  scene.probe_body.translation = {0, 0, -0.5};
  scene.background = {9, 8, 7};
  scene.lamps = {DistantLamp{{std::sin(60 * kDegree), 0, std::cos(60 * kDegree)}, {4, 2, 1}}};
  const MarkerCamera camera(pinhole_lens(161, 121, 600));
  const RadiancePicture picture = render(scene, camera);
  const auto centre = [&](std::size_t patch) {
    const auto pixels = outline_pixels(scene, camera, 0, {outline_centre(scene.body.faces[0].patches[patch].outline)});
    return at_pixel(picture, pixels.value()[0]);
  };
  EXPECT_NEAR(centre(0)[0], 0.5 * 2 / pi, kFloat);
  EXPECT_NEAR(centre(1)[0], 0.6 * 2 / pi, kFloat);
  EXPECT_NEAR(centre(1)[2], 0.2 * 0.5 / pi, kFloat);
  // The margin outside the tag's black border is paper, the border is ink. Tags have 8 cells in 36 mm.
  const double rim = 0.018 + 0.5 * 0.0045, edge = 0.018 - 0.5 * 0.0045;
  EXPECT_NEAR(at_pixel(picture, camera.pixel_of({rim, 0, -0.47}).value())[1], 0.80 * 1 / pi, kFloat);
  EXPECT_NEAR(at_pixel(picture, camera.pixel_of({edge, 0, -0.47}).value())[1], 0.04 * 1 / pi, kFloat);
  EXPECT_NEAR(picture.at(0, 0)[0], 9, 9 * kFloat);
}

TEST(MarkerPicture, APixelOnAnEdgeIsTheMeanOverItsArea) {
  // The cube's right edge, 30 mm of 470: with a focal length of 470 px at x = 80 + 30 px, where pixel 110 has its
  // centre; a principal point 0.3 px further covers 0.8 of it.
  MarkerScene scene;
  scene.body = cube_by_hand();
  scene.probe_body.translation = {0, 0, -0.5};
  scene.ambient = even_ambient({1, 1, 1});
  for (const double shift : {-0.4, -0.1, 0.0, 0.3}) {
    LensParameters lens = pinhole_lens(161, 121, 470);
    std::get<MeiParameters>(lens.model).cx += shift;
    const MarkerCamera camera(lens);
    for (const int rays : {89, 233}) {
      RenderOptions options;
      options.edge_rays = rays;
      EXPECT_NEAR(render(scene, camera, options).at(110, 60)[0], 0.5 * (0.5 + shift), 0.5 * 1.01 / rays);
    }
  }
}

/// Width of a tag perpendicular to its longest side in px: small for foreshortened tags.
double depth_of(const std::array<PixelPosition, 4>& corners) {
  double area = 0, longest = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const PixelPosition &a = corners[k], &b = corners[(k + 1) % 4];
    area += (a.x * b.y - b.x * a.y) / 2;
    longest = std::max(longest, std::hypot(a.x - b.x, a.y - b.y));
  }
  return std::abs(area) / longest;
}

TEST(MarkerPicture, TagsAreDetectedAtTheirProjectedCorners) {
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  const MarkerCamera camera(pinhole_lens(800, 600, 1200));
  int seen = 0;
  double worst = 0, squares = 0;
  for (const double turn : {0.0, 0.2, 0.5, 0.8}) {
    MarkerStage stage;
    stage.distance_m = 0.45;
    stage.turn_rad = turn;
    for (const MarkerBody& body : {cube_by_hand(0.1), body_file("dodecahedron_100mm_white")}) {
      const bool cube = body.faces.size() == 6;
      const MarkerScene scene = lit(body, stage, cube ? 5 : 11);
      RenderOptions options;
      options.edge_rays = 233;
      options.blur_px = 0.6;
      ExposureOptions exposure;
      exposure.full_scale = 0.8;
      exposure.electrons = 0;
      const GreyBytes grey = expose_grey(render(scene, camera, options), exposure);
      const auto found = detector->detect(grey.view());
      ASSERT_TRUE(found);
      EXPECT_GE(found->size(), cube ? 2u : 3u);
      for (const TagDetection& tag : *found) {
        const auto face =
            std::find_if(body.faces.begin(), body.faces.end(), [&](const auto& f) { return f.tag_id == tag.id; });
        ASSERT_NE(face, body.faces.end()) << tag.id;
        const auto truth = tag_corners(scene, camera, static_cast<std::size_t>(face - body.faces.begin()));
        ASSERT_TRUE(truth) << tag.id;
        // For strongly foreshortened tags, the detector's corners have errors of some tenths of a pixel.
        if (!tag.refined || depth_of(*truth) < 24) continue;
        for (std::size_t k = 0; k < 4; ++k) {
          const double off = std::hypot(tag.corners[k].x - (*truth)[k].x, tag.corners[k].y - (*truth)[k].y);
          EXPECT_LT(off, 0.1) << body.name << ", tag " << tag.id << ", corner " << k << ", turned " << turn;
          worst = std::max(worst, off);
          squares += off * off;
          ++seen;
        }
      }
    }
  }
  EXPECT_GE(seen, 4 * 4 * 4);
  // RMS 0.023 px, maximum 0.07; the detector's accuracy is 0.02 in each of x and y.
  EXPECT_LT(std::sqrt(squares / seen), 0.04) << "worst " << worst;
}

TEST(MarkerPicture, TheShadowOfTheDodecahedronIsAtTheGeometricPosition) {
  MarkerStage stage;
  stage.distance_m = 0.7;
  stage.elevation_rad = 40 * kDegree;
  MarkerScene scene = lit(body_file("dodecahedron_100mm_grey"), stage, 11);
  scene.ambient = {};
  const Vec3d lamp = stage.direction(70 * kDegree, 35 * kDegree);
  scene.lamps = {DistantLamp{lamp, {1, 1, 1}}};
  // The corner of the body whose shadow is farthest from the lamp, seen from above.
  const Vec3d up = scene.table->normal;
  EXPECT_NEAR(length(up - stage.up()), 0, 1e-9);
  EXPECT_NEAR(dot(up, stage.probe_body().translation - scene.table->point), 0.05, 1e-9) << "half of 100 mm";
  const Vec3d away = normalized(up * dot(lamp, up) - lamp);
  double farthest = 0;
  Vec3d tip;
  for (const MarkerFace& face : scene.body.faces)
    for (const FacePoint& p : face.outline) {
      const Vec3d corner = transformed(compose(scene.probe_body, face.body_face), {p.x, p.y, 0});
      const Vec3d thrown = corner - lamp * (dot(up, corner - scene.table->point) / dot(up, lamp));
      if (const double far = dot(away, thrown - scene.table->point); far > farthest) farthest = far, tip = thrown;
    }
  EXPECT_GT(farthest, 0.1);
  EXPECT_LT(farthest, 0.2);
  // The shadow of the body's centre is inside.
  const Vec3d middle = scene.probe_body.translation - lamp * (0.05 / dot(up, lamp));
  const Vec3d inward = normalized(middle - tip);
  EXPECT_GT(table_irradiance(scene, tip + away * 1e-5).total()[0], 0.5);
  EXPECT_EQ(table_irradiance(scene, tip + inward * 1e-5).total()[0], 0);

  const MarkerCamera camera(pinhole_lens(640, 480, 700));
  const RadiancePicture picture = render(scene, camera);
  const double light = 0.15 / pi * std::sin(35 * kDegree);
  EXPECT_NEAR(at_pixel(picture, camera.pixel_of(tip + away * 0.004).value())[0], light, kFloat);
  EXPECT_EQ(at_pixel(picture, camera.pixel_of(tip + inward * 0.008).value())[0], 0);
}

TEST(MarkerPicture, ABallIsShadedByTheCosine) {
  MarkerScene scene;
  scene.body = ball_by_hand();
  scene.body.ball->center = {0, 0.06, 0};
  scene.probe_body.translation = {0, -0.06, -0.5};
  const Vec3d lamp = normalized(Vec3d{1, 1, 1});
  scene.lamps = {DistantLamp{lamp, {1, 1, 1}}};
  scene.ambient = even_ambient({0.1, 0.1, 0.1});
  const MarkerCamera camera(pinhole_lens(201, 201, 2000));
  const RadiancePicture picture = render(scene, camera);
  int checked = 0;
  for (int y = 30; y <= 170; y += 10)
    for (int x = 30; x <= 170; x += 10) {
      // The ball's centre is 0.5 m ahead; this is where the ray through the pixel's centre enters it.
      const Vec3d ray = normalized(Vec3d{(x - 100) / 2000.0, (100 - y) / 2000.0, -1});
      const double along = -0.5 * ray.z, under = along * along - (0.25 - 0.0004);
      if (under < 1e-6) continue;
      const Vec3d normal = (ray * (along - std::sqrt(under)) - Vec3d{0, 0, -0.5}) * (1 / 0.02);
      const double expected = 0.7 / pi * (pi * 0.1 + std::max(0.0, dot(normal, lamp)));
      // A pixel is a mean over a curved surface, a hundredth of the radius wide: the difference is about (0.02)^2 / 12
      // of the brightness, more towards the outline.
      EXPECT_NEAR(picture.at(x, y)[0], expected, 2e-3 * expected) << x << ' ' << y;
      ++checked;
    }
  EXPECT_GT(checked, 100);
}

TEST(MarkerPicture, NearerSurfacesOccludeThoseBehind) {
  MarkerScene scene;
  scene.body = cube_by_hand();
  scene.probe_body.translation = {0, 0, -0.5};
  scene.ambient = even_ambient({1, 1, 1});
  scene.occluders = {SphereOccluder{{0.01, 0, -0.3}, 0.003, {0.3, 0.2, 0.1}},
                     PolygonOccluder{{{-1, -1, -0.6}, {1, -1, -0.6}, {1, 1, -0.6}, {-1, 1, -0.6}}, {0.9, 0.9, 0.9}}};
  const MarkerCamera camera(pinhole_lens(161, 121, 600));
  const RadiancePicture picture = render(scene, camera);
  EXPECT_NEAR(at_pixel(picture, camera.pixel_of({0.01, 0, -0.3}).value())[2], 0.1, kFloat);
  EXPECT_NEAR(picture.at(2, 2)[0], 0.9, kFloat);
  EXPECT_NEAR(at_pixel(picture, camera.pixel_of({0.026, 0, -0.47}).value())[0], 0.5, kFloat);
}

TEST(MarkerPicture, SurfacesAndShadowsOfPixels) {
  MarkerScene scene;
  scene.body = cube_by_hand();
  scene.probe_body.translation = {0, -0.1, -0.5};
  scene.table = table_under(scene.body, scene.probe_body, 5, {0.3, 0.3, 0.3});
  // From the right: the shadow of the top edge is as long as the cube is high.
  scene.lamps = {DistantLamp{{0, 1, 0}, {1, 1, 1}}, DistantLamp{{1, 1, 0}, {1, 1, 1}}};
  scene.occluders = {SphereOccluder{{0.06, -0.05, -0.5}, 0.01, {0.5, 0.5, 0.5}}};
  const MarkerCamera camera(pinhole_lens(321, 241, 400));
  const SurfacePicture seen = see_surfaces(scene, camera);
  const auto expect = [&](Vec3d point, Surface surface, std::uint32_t shaded) {
    const PixelPosition p = camera.pixel_of(point).value();
    const std::size_t k = seen.index(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
    EXPECT_EQ(seen.surfaces[k], surface) << p.x << ' ' << p.y;
    EXPECT_EQ(seen.shaded[k], shaded) << p.x << ' ' << p.y;
  };
  expect({0, -0.1, -0.47}, {SurfaceKind::face, 0}, 0);
  expect({-0.02, -0.07, -0.5}, {SurfaceKind::face, 4}, 0);
  // The ball's shadow from the right is 1 cm / sin 45 to both sides of x = 40 mm on the top, which ends at 30.
  expect({0.028, -0.07, -0.5}, {SurfaceKind::face, 4}, 2);
  expect({0.06, -0.05, -0.49}, {SurfaceKind::occluder, 0}, 0);
  expect({-0.05, -0.13, -0.5}, {SurfaceKind::table, 0}, 2);
  expect({-0.11, -0.13, -0.5}, {SurfaceKind::table, 0}, 0);
  expect({0.06, -0.13, -0.5}, {SurfaceKind::table, 0}, 1);
  expect({-0.1, 0.1, -0.5}, {SurfaceKind::none, 0}, 0);
}

TEST(MarkerPicture, BlurConservesLightAndThreadsDoNotChangeTheImage) {
  MarkerStage stage;
  MarkerScene scene = lit(cube_by_hand(), stage, 5);
  scene.table.reset();
  const MarkerCamera camera(pinhole_lens(160, 120, 300));
  RenderOptions options;
  const RadiancePicture sharp = render(scene, camera, options);
  options.threads = 2;
  EXPECT_EQ(render(scene, camera, options).rgb, sharp.rgb);
  options.blur_px = 2;
  const RadiancePicture soft = render(scene, camera, options);
  double before = 0, after = 0, largest = 0, softest = 0;
  for (std::size_t k = 0; k < sharp.rgb.size(); ++k) {
    before += sharp.rgb[k], after += soft.rgb[k];
    largest = std::max(largest, sharp.rgb[k] + 0.0), softest = std::max(softest, soft.rgb[k] + 0.0);
  }
  EXPECT_NEAR(after, before, 1e-5 * before);
  EXPECT_LT(softest, largest);
}

TEST(MarkerExposure, ScalesClipsEncodesAndRepeats) {
  RadiancePicture picture{100, 100, std::vector<float>(30000, 0.4F)};
  for (std::size_t k = 0; k < 3; ++k) picture.rgb[k] = 5;
  ExposureOptions options;
  options.full_scale = 0.8;
  options.electrons = 0;
  EXPECT_EQ(expose(picture, options).rgb[0], 255);
  EXPECT_EQ(expose(picture, options).rgb[300], 128) << "127.5";
  EXPECT_EQ(expose_grey(picture, options).pixels[100], 128);
  EXPECT_EQ(to_grey(expose(picture, options)).pixels[100], 128);
  options.srgb = true;
  EXPECT_EQ(expose(picture, options).rgb[300], 188) << "IEC 61966-2-1 of one half";

  options.srgb = false;
  options.electrons = 10'000;
  const GreyBytes noisy = expose_grey(picture, options);
  EXPECT_EQ(expose_grey(picture, options).pixels, noisy.pixels);
  options.frame = 1;
  EXPECT_NE(expose_grey(picture, options).pixels, noisy.pixels);
  double sum = 0, squares = 0;
  for (std::size_t k = 1; k < noisy.pixels.size(); ++k)
    sum += noisy.pixels[k], squares += noisy.pixels[k] * noisy.pixels[k];
  const double n = 9999, mean = sum / n, variance = squares / n - mean * mean;
  // 5,000 electrons and 3 of reading: 70.8 of 10,000 are 1.805 codes, and a twelfth of a code squared by rounding.
  EXPECT_NEAR(mean, 127.5, 0.08) << "four standard errors of a mean of ten thousand";
  EXPECT_NEAR(std::sqrt(variance), std::sqrt(1.805 * 1.805 + 1.0 / 12), 0.05);
}

}  // namespace
}  // namespace lightwell::reference
