// lightwell-calibrate geometry and coverage: from pictures of a printed board to a lens model and light directions.
#include <cmath>
#include <ctime>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "firmware/calibration/lens_trials.hpp"
#include "firmware/pose/tags_around.hpp"
#include "firmware/tools/calibrate_words.hpp"
#include "firmware/tools/plotted.hpp"
#include "imaging/image_file.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell::calibrate {
namespace {

using test::CommandResult;
using test::kDegree;
using test::run;
using test::TempDir;
using testing::HasSubstr;

constexpr int kEdge = 800, kPictures = 24;

/// A board of about the size of A6 paper.
TagBoard small_board() {
  TagBoard board;
  board.columns = 5;
  board.rows = 5;
  board.tag_size_m = 0.02;
  return board;
}

LensParameters webcam() {
  LensParameters lens = test::fisheye_lens(kEdge);
  lens.width = 640;
  lens.height = 480;
  lens.max_angle_rad = 33 * kDegree;
  // With xi = 0, Mei's distortion is Brown's.
  lens.model = MeiParameters{620, 621, 322, 238, 0, 0.05, -0.1, 0, 0};
  return lens;
}

/// A folder with pictures of the board at positions all over the field of view (by default of a 190 degree lens),
/// with 8 bits, noise and blur.
struct BoardPictureFolder {
  TempDir folder;
  LensParameters truth;
  std::string board, pictures;

  explicit BoardPictureFolder(const LensParameters& lens = test::fisheye_lens(kEdge), double largest_deg = 88,
                              double near_m = 0.14)
      : truth(lens) {
    const TagBoard tags = small_board();
    board = folder.write("board.yaml", tag_board_to_text(tags));
    pictures = folder.path("pictures");
    std::filesystem::create_directory(pictures);
    const test::BoardCamera camera(truth);
    for (int i = 0; i < kPictures; ++i) {
      const Vec3d to = test::direction_at(largest_deg * (i + 0.5) / kPictures, 137.5 * i);
      const auto tangents = tangent_basis(to);
      const double tilt = (i % 2 == 0 ? 1 : -1) * (15 + 20 * (i % 3)) * kDegree;
      const Vec3d towards = -to * std::cos(tilt) + tangents[static_cast<std::size_t>(i / 2 % 2)] * std::sin(tilt);
      test::PictureOptions options;
      options.seed = static_cast<std::uint64_t>(i + 1);
      options.srgb = true;
      const test::PlacedBoard placed = test::board_facing(tags, to * (near_m + 0.02 * (i % 4)), towards, 0.9 * i);
      const auto taken = camera.take({}, std::span(&placed, 1), options);
      Image image;
      image.width = taken.width;
      image.height = taken.height;
      for (const std::uint8_t v : taken.pixels) image.data.insert(image.data.end(), 3, std::byte{v});
      EXPECT_TRUE(write_png(pictures + formatted("/%02d.png", i), image).ok());
    }
  }
};

const BoardPictureFolder& board_pictures() {
  static const BoardPictureFolder it;
  return it;
}

TEST(CalibrateGeometry, RecoversTheLensParameters) {
  const BoardPictureFolder& s = board_pictures();
  const TempDir out;
  const CommandResult result = run(geometry_command, {"--board", s.board, "--lens0", s.pictures, "--field-deg", "190",
                                                      "--output", out.path("rig.textproto"), "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\"sigma_px\""));
  const Result<RigParameters> rig = load_calibration(out.path("rig.textproto"));
  ASSERT_TRUE(rig) << rig.status().message();
  EXPECT_LT(shown::direction_error(s.truth, rig->lenses[0].model), 0.05 * kDegree)
      << "RMS over the lens up to its edge";
  EXPECT_NEAR(rig->lenses[0].max_angle_rad, 95 * kDegree, 1e-9);
  EXPECT_EQ(rig->lenses[0].photometry.response.kind, ResponseCurve::Kind::srgb)
      << "the response with which the pictures were read";
  EXPECT_THAT(result.out, HasSubstr("\"flatness_mm\""));
  EXPECT_THAT(result.out, HasSubstr("\"other_board\":false"));
  const auto json = nlohmann::json::parse(result.out);
  const auto& covered = json["coverage"].at(0);
  std::size_t points = 0;
  for (const auto& picture : json["pictures"])
    points += picture["points"].get<std::size_t>() - picture["outliers"].get<std::size_t>();
  EXPECT_EQ(covered["points"].size(), points) << "each fitted point is drawn";
  double squares = 0;
  for (const auto& p : covered["points"])
    squares += p[2].get<double>() * p[2].get<double>() + p[3].get<double>() * p[3].get<double>();
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(points)), json["rms_px"].get<double>(), 1e-3);
  const Result<Image> report = read_image(test::plotted(out, result.out, "report.png"));
  ASSERT_TRUE(report) << report.status().message();
  EXPECT_GT(report->width, 400);
  ASSERT_TRUE(rig->report) << "the file has a report for the probe";
  EXPECT_NEAR(rig->report->rms_px, json["rms_px"].get<double>(), 1e-6);
  EXPECT_EQ(rig->report->points, points);
  ASSERT_EQ(rig->report->seen_deg.size(), 1U);
  EXPECT_NEAR(rig->report->seen_deg[0], json["lenses"].at(0)["seen_deg"].get<double>(), 1e-6);
  EXPECT_NEAR(static_cast<double>(rig->report->geometry_time_s), static_cast<double>(std::time(nullptr)), 600);
  EXPECT_EQ(rig->report->photometry_time_s, 0);

  // A lamp of one degree, rendered through the true lens and estimated with the calibrated one.
  for (const double theta : {5.0, 45.0, 80.0}) {
    const Vec3d to = test::direction_at(theta, 200);
    const sim::Scene scene(sim::from_function(2048, [&](Vec3d d) {
      const float l = angle_between(d, to) < 0.5 * kDegree ? 20'000.0F : 1.0F;
      return Radiance{l, l, l};
    }));
    const std::vector<float> radiance = sim::render_radiance(scene, scene.state_at(0), s.truth, 4);
    Result<std::unique_ptr<Estimator>> estimator = make_panorama_estimator(*rig, {});
    ASSERT_TRUE(estimator) << estimator.status().message();
    Frame frame;
    frame.info.exposure_s = 1;
    frame.add_view({0, PixelFormat::rgb_f32, kEdge, kEdge, packed_stride(PixelFormat::rgb_f32, kEdge),
                    std::as_bytes(std::span(radiance))});
    Descriptor d;
    const Status done = (*estimator)->estimate(std::span(&frame, 1), d);
    ASSERT_TRUE(done.ok()) << done.message();
    ASSERT_FALSE(d.lights.empty()) << theta;
    EXPECT_LT(angle_between(vec_cast<double>(d.lights[0].direction), to), 0.2 * kDegree)
        << theta << " degrees from the axis";
  }
}

TEST(CalibrateGeometry, ReportsPicturesWithoutTagsAndAWrongBoardSpacing) {
  const BoardPictureFolder& s = board_pictures();
  const TempDir out;
  Image empty;
  empty.width = empty.height = kEdge;
  empty.data.assign(std::size_t{3} * kEdge * kEdge, std::byte{128});
  ASSERT_TRUE(write_png(out.path("wall.png"), empty).ok());
  TagBoard stated = small_board();
  stated.spacing = 0.32;
  const CommandResult result =
      run(geometry_command, {"--board", out.write("stated.yaml", tag_board_to_text(stated)), "--lens0", s.pictures,
                             out.path("wall.png"), "--output", out.path("rig.textproto")});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("wall.png shows no tag of a board"));
  EXPECT_THAT(result.err,
              HasSubstr("stated.yaml': the distance between its tags differs from its description by -1.5"));
  EXPECT_THAT(result.out, HasSubstr("pictures were read with the response: sRGB"));
  const Result<RigParameters> rig = load_calibration(out.path("rig.textproto"));
  ASSERT_TRUE(rig) << rig.status().message();
  LensParameters seen = s.truth;
  seen.max_angle_rad = 80 * kDegree;
  EXPECT_LT(shown::direction_error(seen, rig->lenses[0].model), 0.05 * kDegree);
}

TEST(CalibrateGeometry, OtherModelsFitTheSameLens) {
  const BoardPictureFolder& s = board_pictures();
  const TempDir out;
  for (const char* model : {"double-sphere", "mei"}) {
    const CommandResult result = run(geometry_command, {"--board", s.board, "--lens0", s.pictures, "--model", model,
                                                        "--output", out.path("rig.textproto")});
    ASSERT_EQ(result.status, 0) << result.err;
    const Result<RigParameters> rig = load_calibration(out.path("rig.textproto"));
    ASSERT_TRUE(rig) << rig.status().message();
    // The pictures were rendered with another model.
    LensParameters seen = s.truth;
    seen.max_angle_rad = 80 * kDegree;
    EXPECT_LT(shown::direction_error(seen, rig->lenses[0].model), 0.3 * kDegree) << model;
  }
}

TEST(CalibrateGeometry, AWebcamDeterminesMeiButNotDoubleSphere) {
  const BoardPictureFolder s(webcam(), 20, 0.25);
  const TempDir out;
  const std::vector<std::string> words = {
      "--board", s.board, "--lens0", s.pictures, "--output", out.path("rig.textproto"), "--model"};
  const auto with = [&](const char* model) {
    std::vector<std::string> all = words;
    all.emplace_back(model);
    return run(geometry_command, all);
  };
  const CommandResult refused = with("double-sphere");
  EXPECT_EQ(refused.status, 1) << refused.out;
  EXPECT_THAT(refused.err, HasSubstr("do not determine the numbers of the model double-sphere; they determine"));
  EXPECT_FALSE(std::filesystem::exists(out.path("rig.textproto"))) << "nothing is written";
  const CommandResult result = with("mei");
  ASSERT_EQ(result.status, 0) << result.err;
  const Result<RigParameters> rig = load_calibration(out.path("rig.textproto"));
  ASSERT_TRUE(rig) << rig.status().message();
  LensParameters seen = s.truth;
  seen.max_angle_rad = 25 * kDegree;
  EXPECT_LT(shown::direction_error(seen, rig->lenses[0].model), 0.02 * kDegree);
}

TEST(CalibrateGeometry, CoverageReportsMissingViews) {
  const BoardPictureFolder& s = board_pictures();
  const TempDir out;
  const CommandResult all =
      run(coverage_command, {"--board", s.board, "--lens0", s.pictures, "--field-circle-px", "300"});
  EXPECT_THAT(all.out, HasSubstr("of the picture known from 24 pictures"));
  const CommandResult one = run(coverage_command, {"--board", s.board, "--lens0", s.pictures + "/23.png"});
  EXPECT_EQ(one.status, 3);
  EXPECT_THAT(one.out, HasSubstr("show the board in the"));
  EXPECT_THAT(one.out, HasSubstr("take 19 more pictures"));
  const CommandResult json = run(coverage_command, {"--board", s.board, "--lens0", s.pictures + "/23.png", "--json"});
  EXPECT_EQ(json.status, 3);
  EXPECT_THAT(test::read_file(test::plotted(out, json.out, "seen.svg")), HasSubstr("lens 0: 1 pictures, "));
}

TEST(CalibrateGeometry, RejectsInvalidInputs) {
  const BoardPictureFolder& s = board_pictures();
  const TempDir out;
  const std::string to = out.path("rig.textproto");
  const auto refused = [&](std::vector<std::string> words, int status, const char* what) {
    words.insert(words.end(), {"--output", to});
    const CommandResult result = run(geometry_command, words);
    EXPECT_EQ(result.status, status) << what;
    EXPECT_THAT(result.err, HasSubstr(what));
    EXPECT_FALSE(std::filesystem::exists(to)) << "nothing is written";
  };
  refused({"--board", s.board, "--lens0", s.pictures + "/01.png", s.pictures + "/02.png"}, 1, "take at least 5");
  refused({"--board", s.board, "--lens0", out.path("nowhere")}, 1, "nowhere");
  refused({"--board", out.write("no.yaml", "target_type: 'checkerboard'\n"), "--lens0", s.pictures}, 1, "no.yaml");
  refused({"--board", s.board, "--board", s.board, "--lens0", s.pictures}, 1, "is on");
  refused({"--board", s.board, "--lens0", s.pictures, "--time-offset"}, 2, "--lens1");
  Image small;
  small.width = 640, small.height = 480;
  small.data.assign(3 * 640 * 480, std::byte{128});
  ASSERT_TRUE(write_png(out.path("small.png"), small).ok());
  refused({"--board", s.board, "--lens0", s.pictures + "/01.png", out.path("small.png")}, 1, "640x480");
}

}  // namespace
}  // namespace lightwell::calibrate
