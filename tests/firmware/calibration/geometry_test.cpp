// Tests of calibrate_geometry() with simulated observations: recovery of lenses and pairs, and errors.
#include "calibration/solve/geometry/geometry.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/model/cameras.hpp"
#include "calibration/solve/geometry/initial.hpp"
#include "firmware/calibration/lens_trials.hpp"
#include "firmware/calibration/shown_boards.hpp"

namespace lightwell::calibration {
namespace {

using shown::direction_error;
using shown::one_lens;
using shown::Show;
using std::numbers::pi;
using testing::HasSubstr;
constexpr double kDegree = pi / 180;

LensParameters kannala_brandt() { return shown::lens_of(LensKind::kannala_brandt); }

GeometryFit fitted(const BoardObservations& s, const GeometryOptions& options) {
  const Result<GeometryFit> fit = calibrate_geometry(s, options);
  EXPECT_TRUE(fit) << fit.status().message();
  return fit ? *fit : GeometryFit{};
}

struct Lens {
  const char* name;
  LensKind kind;
};
class OneLens : public testing::TestWithParam<Lens> {};

TEST_P(OneLens, IsRecoveredFromFortyPictures) {
  const Lens& lens = GetParam();
  const LensParameters truth = shown::lens_of(lens.kind);
  const GeometryFit fit = fitted(one_lens(truth, {}), {.kind = lens.kind});
  ASSERT_EQ(fit.lenses.size(), 1U);
  EXPECT_NEAR(fit.bundle.sigma_px, 0.2, 0.02);
  EXPECT_LT(direction_error(truth, fit.lenses[0].model), 0.05 * kDegree) << "RMS over the whole field of view";
  EXPECT_GT(fit.lenses[0].max_observed_angle_rad, 93 * kDegree);
  EXPECT_LT(direction_error(truth, fit.lenses[0].model), fit.lenses[0].direction_uncertainty_rad)
      << "within three standard deviations";
}

TEST_P(OneLens, WithoutNoiseIsRecoveredExactly) {
  const Lens& lens = GetParam();
  const LensParameters truth = shown::lens_of(lens.kind);
  const GeometryFit fit = fitted(one_lens(truth, {.noise_px = 0}), {.kind = lens.kind});
  ASSERT_EQ(fit.lenses.size(), 1U);
  EXPECT_LT(fit.bundle.rms_px, 1e-5);
  EXPECT_LT(direction_error(truth, fit.lenses[0].model), 1e-5 * kDegree);
}

TEST_P(OneLens, IsRecoveredWithTwoPercentOutliers) {
  const Lens& lens = GetParam();
  const LensParameters truth = shown::lens_of(lens.kind);
  const GeometryFit fit = fitted(one_lens(truth, {.wrong_share = 0.02}), {.kind = lens.kind});
  ASSERT_EQ(fit.lenses.size(), 1U);
  EXPECT_LT(direction_error(truth, fit.lenses[0].model), 0.05 * kDegree);
  EXPECT_FALSE(fit.notes.empty()) << "rejected observations must be noted";
}

INSTANTIATE_TEST_SUITE_P(Kinds, OneLens,
                         testing::Values(Lens{"KannalaBrandt", LensKind::kannala_brandt},
                                         Lens{"DoubleSphere", LensKind::double_sphere}, Lens{"Mei", LensKind::mei}),
                         [](const auto& each) { return std::string(each.param.name); });

TEST(OneLensOfAnyKind, HasItsFocalLengthWithinATenthOfAPercent) {
  const LensParameters truth = kannala_brandt();
  const auto& wanted = std::get<KannalaBrandtParameters>(truth.model);
  const GeometryFit fit = fitted(one_lens(truth, {}), {});
  ASSERT_EQ(fit.lenses.size(), 1U);
  const auto& found = std::get<KannalaBrandtParameters>(fit.lenses[0].model);
  EXPECT_NEAR(found.fx / wanted.fx, 1, 1e-3);
  EXPECT_NEAR(found.fy / wanted.fy, 1, 1e-3);
}

TEST(OneLensOfAnyKind, ReportsInsufficientObservations) {
  const auto refused = [](const BoardObservations& s, const char* what) {
    const Result<GeometryFit> fit = calibrate_geometry(s, {});
    ASSERT_FALSE(fit) << what;
    EXPECT_EQ(fit.status().code(), StatusCode::failed_precondition);
    EXPECT_THAT(fit.status().message(), HasSubstr(what));
  };
  refused(one_lens(kannala_brandt(), {.pictures = 4}), "take at least 5");

  // Fronto-parallel boards at one distance.
  Show frontal{.tilt_rad = 0};
  BoardObservations facing = one_lens(kannala_brandt(), frontal);
  const CameraModel camera(kannala_brandt());
  for (Picture& p : facing.pictures) {
    p.observations.clear();
    for (int k = 0; k < 144; ++k) {
      const Vec3d at =
          facing.boards[0].points[static_cast<std::size_t>(k)] + Vec3d{-0.11, -0.11, 0.3 + 0.01 * p.capture};
      const auto pixel = camera.project(at);
      ASSERT_TRUE(pixel);
      p.observations.push_back({0, k, *pixel});
    }
  }
  refused(facing, "tilt the board");

  BoardObservations single = one_lens(kannala_brandt(), {});
  for (Picture& p : single.pictures)
    std::erase_if(p.observations, [](const PointObservation& s) { return s.point >= 4; });
  refused(single, "only one tag");
}

TEST(OneLensOfAnyKind, RefusesInvalidObservations) {
  const auto refused = [](const BoardObservations& s, const char* what) {
    const Result<GeometryFit> fit = calibrate_geometry(s, {});
    ASSERT_FALSE(fit) << what;
    EXPECT_EQ(fit.status().code(), StatusCode::invalid_argument);
    EXPECT_THAT(fit.status().message(), HasSubstr(what));
  };
  const BoardObservations good = one_lens(kannala_brandt(), {});
  BoardObservations s = good;
  s.pictures[3].observations[2].pixel.x = std::nan("");
  refused(s, "picture 3");
  s = good;
  s.pictures[3].observations[2].pixel.x = 2000;
  refused(s, "outside its 1280x960 pixels");
  s = good;
  s.pictures[3].observations[2].point = 999;
  refused(s, "that no board has");
  s = good;
  s.pictures[0].lens = 1;
  refused(s, "is of lens 1");
  s = good;
  s.boards[0].points[5].z = 0.01;
  refused(s, "not flat");
}

struct Printed {
  const char* name;
  Show show;
  const char* note;
};
class OtherwisePrinted : public testing::TestWithParam<Printed> {};

TEST_P(OtherwisePrinted, IsReportedAndEstimated) {
  const GeometryFit fit = fitted(one_lens(kannala_brandt(), GetParam().show), {});
  ASSERT_EQ(fit.lenses.size(), 1U);
  EXPECT_THAT(fit.notes, testing::Contains(HasSubstr(GetParam().note)));
  EXPECT_LT(direction_error(kannala_brandt(), fit.lenses[0].model), 0.03 * kDegree);
  EXPECT_LT(shown::observed_direction_error(kannala_brandt(), fit.lenses[0]), fit.lenses[0].direction_uncertainty_rad);
  EXPECT_NEAR(fit.bundle.sigma_px, 0.2, 0.02) << "the residuals must not contain the board's shape";
}

INSTANTIATE_TEST_SUITE_P(
    Boards, OtherwisePrinted,
    testing::Values(Printed{"Cylinder", {.bend = shown::Bend::cylinder}, "is not flat: its points span 2.0"},
                    Printed{"Sphere", {.bend = shown::Bend::sphere}, "is not flat: its points span 4.1"},
                    Printed{"WiderSpacing", {.spacing = 0.32}, "differs from its description by 1.5"}),
    [](const auto& each) { return std::string(each.param.name); });

TEST(OtherwisePrintedBoard, ThatIsFlatHasNoShape) {
  const GeometryFit fit = fitted(one_lens(kannala_brandt(), {}), {});
  ASSERT_EQ(fit.boards.size(), 1U);
  EXPECT_EQ(fit.boards[0].flatness_m, 0);
  EXPECT_EQ(fit.boards[0].shape.spacing_change(), 0);
  EXPECT_TRUE(fit.notes.empty()) << fit.notes[0];
}

TEST(OtherwisePrintedBoard, PicturesOfAnotherBoardAreNamedAndRejected) {
  const GeometryFit fit = fitted(one_lens(kannala_brandt(), {.other_spacing_pictures = 3}), {});
  ASSERT_EQ(fit.pictures.size(), 40U);
  for (std::size_t i = 0; i < fit.pictures.size(); ++i) EXPECT_EQ(fit.pictures[i].other_board, i < 3) << i;
  EXPECT_THAT(fit.notes, testing::Contains(testing::StartsWith("picture 2 was rejected")));
  EXPECT_LT(direction_error(kannala_brandt(), fit.lenses[0].model), 0.03 * kDegree);
}

LensParameters webcam() {
  LensParameters lens;
  lens.width = 640;
  lens.height = 480;
  lens.max_angle_rad = 33 * kDegree;
  lens.pose_cv.rotation = upright_lens_cv();
  // With xi = 0 the Mei model is a pinhole with Brown's distortion.
  lens.model = MeiParameters{620, 621, 322, 238, 0, 0.05, -0.1, 1e-3, -5e-4};
  return lens;
}

TEST(Webcam, DoesNotDetermineADoubleSphere) {
  const BoardObservations s = one_lens(webcam(), {.noise_px = 0.1, .nearest_m = 0.3, .farthest_m = 0.7});
  const Result<GeometryFit> fit = calibrate_geometry(s, {.kind = LensKind::double_sphere});
  ASSERT_FALSE(fit) << "fx " << parameters_of(fit->lenses[0].model)[0] << " +- "
                    << std::sqrt(fit->lenses[0].covariance[0]);
  EXPECT_EQ(fit.status().code(), StatusCode::failed_precondition);
  EXPECT_THAT(fit.status().message(),
              HasSubstr("do not determine the numbers of the model double-sphere; they determine mei"));
}

TEST(Webcam, DeterminesMeiWhichHasBrownsDistortion) {
  const BoardObservations s = one_lens(webcam(), {.noise_px = 0.1, .nearest_m = 0.3, .farthest_m = 0.7});
  const GeometryFit fit = fitted(s, {.kind = LensKind::mei});
  ASSERT_EQ(fit.lenses.size(), 1U);
  EXPECT_NEAR(fit.bundle.sigma_px, 0.1, 0.01);
  EXPECT_LT(direction_error(webcam(), fit.lenses[0].model), 0.05 * kDegree);
}

void expect_pair(const GeometryFit& fit, const Pose& truth) {
  const shown::PairError off = shown::pair_error(truth, fit.bundle.state.lens_from_rig[1]);
  EXPECT_LT(off.turn_rad, 0.1 * kDegree);
  EXPECT_LT(off.shift_m, 1e-3);
}

TEST(PairOfLenses, IsRecoveredWithFourBoards) {
  const shown::Pair pair = shown::back_to_back();
  const GeometryFit fit = fitted(shown::pair_of_lenses(pair, {.pictures = 60}), {});
  ASSERT_EQ(fit.lenses.size(), 2U);
  expect_pair(fit, pair.lens1_from_lens0);
  for (const LensFit& lens : fit.lenses) EXPECT_LT(direction_error(pair.lens, lens.model), 0.05 * kDegree);
}

TEST(PairOfLenses, TimeOffsetIsRecovered) {
  shown::Pair pair = shown::back_to_back();
  pair.later_s = 0.004;
  const GeometryFit fit = fitted(shown::pair_of_lenses(pair, {.pictures = 60}), {.time_offset = true});
  ASSERT_EQ(fit.lenses.size(), 2U);
  EXPECT_NEAR(fit.bundle.state.time_offset_s, pair.later_s, 1e-4);
  EXPECT_NEAR(fit.bundle.state.time_offset_s, pair.later_s, 3 * fit.bundle.time_offset_sigma_s + 2e-5)
      << "at 20 captures per second the motion is not exactly linear";
  expect_pair(fit, pair.lens1_from_lens0);
}

TEST(PairOfLenses, WithoutCommonCapturesIsRefused) {
  const shown::Pair pair = shown::back_to_back();
  BoardObservations s = shown::pair_of_lenses(pair, {.pictures = 60});
  // The lenses have no common captures.
  for (Picture& p : s.pictures)
    if (p.capture % 2 == p.lens) p.observations.clear();
  const Result<GeometryFit> fit = calibrate_geometry(s, {});
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.status().message(), HasSubstr("no capture joins the two lenses"));
}

TEST(PairOfLenses, UnconnectedBoardsAreNamed) {
  BoardObservations s = one_lens(kannala_brandt(), {});
  s.boards.push_back(s.boards[0]);
  s.boards[0].name = "left", s.boards[1].name = "right";
  for (Picture& p : s.pictures)
    if (p.capture % 2 != 0)
      for (PointObservation& k : p.observations) k.board = 1;
  const Result<GeometryFit> fit = calibrate_geometry(s, {});
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.status().message(), HasSubstr("'right'"));
}

TEST(BoardPose, IsRecoveredForAnyPosition) {
  const Board board = shown::board();
  for (int i = 0; i < 50; ++i) {
    const double a = i;
    const Pose truth{Quat{std::sin(a), std::cos(2 * a), std::sin(3 * a), 0.3}.normalized(),
                     {std::sin(5 * a), std::cos(7 * a), std::sin(11 * a)}};
    std::vector<Vec3d> directions;
    for (const Vec3d& p : board.points) directions.push_back(normalized(transformed(truth, p)));
    const auto found = board_pose(board.points, directions);
    ASSERT_TRUE(found) << i;
    EXPECT_LT(length(found->translation - truth.translation), 1e-6) << i;
    const Quat q = found->rotation * truth.rotation.inverse();
    EXPECT_LT(std::hypot(q.x, q.y, q.z), 1e-6) << i;
  }
}

TEST(BoardPose, IsEmptyForDegeneratePoints) {
  const std::vector<Vec3d> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  std::vector<Vec3d> directions;
  for (const Vec3d& p : line) directions.push_back(normalized(p + Vec3d{0, 0, 3}));
  EXPECT_FALSE(board_pose(line, directions));
  EXPECT_FALSE(board_pose(std::span(line).first(3), std::span(directions).first(3)));
  const std::vector<Vec3d> same(6, Vec3d{1, 1, 0}), ahead(6, Vec3d{0, 0, 1});
  EXPECT_FALSE(board_pose(same, ahead));
  const std::vector<Vec3d> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<Vec3d> none(4, Vec3d{std::nan(""), 0, 1});
  EXPECT_FALSE(board_pose(square, none));
}

}  // namespace
}  // namespace lightwell::calibration
