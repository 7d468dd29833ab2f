#include "measure/traced_frames.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <OpenEXR/ImfRgbaFile.h>
#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::measure {
namespace {

// A pinhole of 120x90 with a focal length of 100 px, and a body with one square face of 0.4 m that faces it at a
// distance of 1 m. In the image the face is 40 px wide and centred at (59.5, 44.5).
constexpr const char* kScenes = R"({"frames": {
  "b_frame": {"file": "b.exr", "group": "grid", "body": "white", "turn_about_y_deg": 36.0,
    "camera": {"width": 120, "height": 90, "fx_px": 100.0, "fy_px": 100.0, "cx_px": 59.5, "cy_px": 44.5},
    "T_probe_body": {"q_xyzw": [0, 0, 0, 1], "t_m": [0, 0, -1]},
    "lamps": [{"direction": [0, 0.6, 0.8], "position_m": [0, 0.6, -0.2], "distance_m": 1, "azimuth_deg": 45.0,
               "irradiance_rgb": [3, 2, 1], "seen_faces_lit": [0]}],
    "ambient_radiance_rgb": [0.1, 0.2, 0.3], "board": null},
  "a_frame": {"file": "a.exr", "group": "air", "body": "grey", "turn_about_y_deg": 0,
    "camera": {"width": 120, "height": 90, "fx_px": 100, "fy_px": 100, "cx_px": 59.5, "cy_px": 44.5},
    "T_probe_body": {"q_xyzw": [0, 0, 0, 1], "t_m": [0, 0, -1]}, "lamps": [], "ambient_radiance_rgb": [0, 0, 0],
    "board": {"center_m": [0, -0.1, -1], "normal": [0, 1, 0], "x": [1, 0, 0], "size_m": [2, 1], "albedo": 0.35}}}})";

MarkerPatch square(double x, double y, double half, double albedo) {
  return {{{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}},
          {albedo, albedo, albedo}};
}

/// A white patch on the left, a grey one on the right.
MarkerBody one_face() {
  MarkerBody body;
  body.tag_size_m = 0.02;
  MarkerFace face;
  face.outline = square(0, 0, 0.2, 1).outline;
  face.patches = {square(-0.1, 0, 0.06, 0.8), square(0.1, 0, 0.06, 0.4)};
  body.faces = {face};
  return body;
}

/// Radiance `left` in columns up to the middle and `right` beyond.
void write_exr(const std::string& path, int width, float left, float right) {
  const int height = 90;
  std::vector<Imf::Rgba> pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float v = x < width / 2 ? left : right;
      pixels.emplace_back(v, v, v);
    }
  Imf::RgbaOutputFile file(path.c_str(), width, height, Imf::WRITE_RGB);
  file.setFrameBuffer(pixels.data(), 1, static_cast<std::size_t>(width));
  file.writePixels(height);
}

int byte_at(const Shot& shot, int x, int y) {
  const View& view = shot.frames.front().views().front();
  return static_cast<int>(view.data[static_cast<std::size_t>(y) * view.stride + 3 * static_cast<std::size_t>(x)]);
}

TEST(TracedFrames, AreSortedByName) {
  const test::TempDir folder;
  folder.write("scenes.json", kScenes);
  const auto frames = load_traced_frames(folder.path(""));
  ASSERT_TRUE(frames) << frames.status().message();
  ASSERT_EQ(frames->size(), 2U);
  const TracedFrame &a = frames->at(0), &b = frames->at(1);
  EXPECT_EQ(a.name, "a_frame");
  EXPECT_EQ(a.view, "straight");
  EXPECT_EQ(a.place, "other");
  ASSERT_TRUE(a.board);
  EXPECT_EQ(a.board->center, (Vec3d{0, -0.1, -1}));
  EXPECT_EQ(a.board->size_m, (std::array<double, 2>{2, 1}));
  EXPECT_EQ(a.board->albedo, 0.35);
  EXPECT_EQ(b.file, "b.exr");
  EXPECT_EQ(b.group, "grid");
  EXPECT_EQ(b.body, "white");
  EXPECT_EQ(b.view, "turned");
  EXPECT_EQ(b.place, "front_right");
  EXPECT_FALSE(b.board);
  EXPECT_EQ(b.probe_body.translation, (Vec3d{0, 0, -1}));
  ASSERT_EQ(b.lamps.size(), 1U);
  EXPECT_NEAR(angle_between(b.lamps[0].direction, Vec3d{0, 0.6, 0.8}), 0, 1e-9);
  EXPECT_EQ(b.lamps[0].irradiance[1], 2);
  EXPECT_EQ(b.lamps[0].visible_lit_faces, 1);
  // The probe's -Z axis points to the image centre, its +Y axis up.
  const CameraModel model(b.rig.lenses.front());
  const auto pixel = model.project(transformed(inverse(b.rig.lenses.front().pose_cv), {0.1, 0.2, -1}));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, 69.5, 1e-9);
  EXPECT_NEAR(pixel->y, 24.5, 1e-9);
}

TEST(TracedFrames, IrradianceIsTheSumOfLampsAboveTheHorizonAndAmbientLight) {
  const test::TempDir folder;
  folder.write("scenes.json", kScenes);
  const TracedFrame frame = load_traced_frames(folder.path(""))->at(1);
  constexpr std::array<double, 3> kLamp = {3, 2, 1}, kAround = {0.1, 0.2, 0.3};
  EXPECT_EQ(frame.ambient_radiance, kAround);
  const std::array<Vec3d, 3> normals = {Vec3d{0, 0.6, 0.8}, Vec3d{0, 0, 1}, Vec3d{0, -1, 0}};
  const auto irradiance = true_irradiance(frame, normals);
  for (std::size_t c = 0; c < 3; ++c) {
    const double around = std::numbers::pi * kAround[c];
    EXPECT_NEAR(irradiance[0][c], kLamp[c] + around, 1e-12) << "straight below the lamp";
    EXPECT_NEAR(irradiance[1][c], 0.8 * kLamp[c] + around, 1e-12) << "a cosine of 0.8";
    EXPECT_NEAR(irradiance[2][c], around, 1e-12) << "turned away";
  }
}

TEST(TracedFrames, IrradianceContainsTheLightOfTheBoard) {
  const test::TempDir folder;
  folder.write("scenes.json", kScenes);
  TracedFrame frame = load_traced_frames(folder.path(""))->at(0);
  // So large a board and so far a lamp that the board is a half space of uniform radiance.
  frame.board->size_m = {1e6, 1e6};
  frame.ambient_radiance = {0.1, 0.2, 0.3};
  TracedLamp lamp;
  lamp.direction = {0, 0.6, 0.8};
  lamp.distance_m = 1e9;
  lamp.irradiance = {3, 2, 1};
  frame.lamps = {lamp};
  const std::array<Vec3d, 3> normals = {Vec3d{0, -1, 0}, Vec3d{1, 0, 0}, Vec3d{0, 1, 0}};
  const auto irradiance = true_irradiance(frame, normals);
  for (std::size_t i = 0; i < normals.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const double around = std::numbers::pi * frame.ambient_radiance[c], above = (1 + normals[i].y) / 2;
      const double board = 0.35 * (around + 0.6 * lamp.irradiance[c]);
      // The tolerance is the error of the sum over directions.
      EXPECT_NEAR(irradiance[i][c],
                  above * around + (1 - above) * board + lamp.irradiance[c] * std::max(0.0, 0.6 * normals[i].y), 2e-3)
          << i;
    }
}

TEST(TracedFrames, MissingFieldsAreNamed) {
  const test::TempDir folder;
  EXPECT_EQ(load_traced_frames(folder.path("")).status().code(), StatusCode::not_found);
  std::string text = kScenes;
  text.replace(text.find("\"fy_px\""), 7, "\"fy\"");
  folder.write("scenes.json", text);
  const Status s = load_traced_frames(folder.path("")).status();
  EXPECT_EQ(s.code(), StatusCode::data_loss);
  EXPECT_NE(s.message().find("fy_px"), std::string::npos) << s.message();
}

TEST(TracedPicture, TheWhitePatchIsExposedToFourFifths) {
  const test::TempDir folder;
  folder.write("scenes.json", kScenes);
  write_exr(folder.path("b.exr"), 120, 2.0F, 2.25F);
  const TracedFrame frame = load_traced_frames(folder.path(""))->at(1);
  const auto picture = TracedPicture::load(folder.path(""), frame, one_face());
  ASSERT_TRUE(picture) << picture.status().message();
  // The brighter half contains no white patch.
  EXPECT_NEAR(picture->white_radiance(), 2.0, 1e-6);
  TracedSensor quiet;
  quiet.electrons = quiet.read_noise = 0;
  // 0.8 of 255, and 0.9 of 255; sRGB of 0.8 is 0.9063.
  EXPECT_EQ(byte_at(picture->expose(quiet, 1), 20, 45), 204);
  EXPECT_NEAR(byte_at(picture->expose(quiet, 1), 100, 45), 229.5, 0.51);
  quiet.srgb = true;
  EXPECT_EQ(byte_at(picture->expose(quiet, 1), 20, 45), 231);
}

TEST(TracedPicture, NoiseHasTheSpecifiedSigmaAndDiffersBetweenFrames) {
  const test::TempDir folder;
  folder.write("scenes.json", kScenes);
  write_exr(folder.path("b.exr"), 120, 2.0F, 2.0F);
  const TracedFrame frame = load_traced_frames(folder.path(""))->at(1);
  const auto picture = TracedPicture::load(folder.path(""), frame, one_face());
  ASSERT_TRUE(picture) << picture.status().message();
  const Shot first = picture->expose({}, 1), again = picture->expose({}, 1), second = picture->expose({}, 2);
  EXPECT_EQ(first.pixels, again.pixels);
  EXPECT_NE(first.pixels, second.pixels);
  double sum = 0, squares = 0;
  for (const std::byte b : first.pixels.front()) {
    const double v = static_cast<int>(b) / 255.0 - 0.8;
    sum += v;
    squares += v * v;
  }
  const auto count = static_cast<double>(first.pixels.front().size());
  // Shot noise sqrt(0.8 / 10,000) = 0.00894, read noise 0.003, rounding 1 / 255 / sqrt(12) = 0.00113: together 0.00950.
  // With 32,400 values the standard error of the mean is 5e-5, of the standard deviation 4e-5.
  EXPECT_NEAR(sum / count, 0, 3e-4);
  EXPECT_NEAR(std::sqrt(squares / count), 0.00950, 2e-4);
}

TEST(TracedPicture, AWrongSizeOrNoVisibleWhitePatchIsRejected) {
  const test::TempDir folder;
  folder.write("scenes.json", kScenes);
  const TracedFrame frame = load_traced_frames(folder.path(""))->at(1);
  EXPECT_EQ(TracedPicture::load(folder.path(""), frame, one_face()).status().code(), StatusCode::not_found);
  write_exr(folder.path("b.exr"), 100, 2.0F, 2.0F);
  EXPECT_EQ(TracedPicture::load(folder.path(""), frame, one_face()).status().code(), StatusCode::data_loss);
  write_exr(folder.path("b.exr"), 120, 2.0F, 2.0F);
  MarkerBody away = one_face();
  away.faces[0].body_face.rotation = Quat::about({0, 1, 0}, std::numbers::pi);
  EXPECT_EQ(TracedPicture::load(folder.path(""), frame, away).status().code(), StatusCode::data_loss);
}

}  // namespace
}  // namespace lightwell::measure
