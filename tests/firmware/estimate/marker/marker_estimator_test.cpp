// MarkerEstimator with a given pose, on pictures of a ball: what it takes from DetectedBody, from the calibration and
// from the kind of body.
#include "estimate/marker/marker_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/lens_table.hpp"
#include "firmware/estimate/marker/shipped_bodies.hpp"

namespace lightwell::marker {
namespace {

/// Returns the same body in every frame.
class GivenBody final : public BodyFinder {
 public:
  explicit GivenBody(const DetectedBody& body) : body_(body) {}
  void set_decimation(const FinderDecimation&) override {}
  Result<std::optional<DetectedBody>> find(const View&, const FrameInfo&) override { return std::optional(body_); }

 private:
  DetectedBody body_;
};

/// A white ball on a dark table, with its shadow, below a small lamp and an even sky. `size`: of everything, relative
/// to the shipped body at 25 cm, so that the picture is the same. `lamp_m`: from the ball's centre.
class BallScene {
 public:
  explicit BallScene(double size = 1, double lamp_m = std::numeric_limits<double>::infinity())
      : body_(test::shipped_body("ball_40mm")) {
    rig_.lenses = {test::pinhole()};
    body_.ball->radius_m *= size;
    body_.ball->center = body_.ball->center * size;
    MarkerFace& sheet = body_.faces.front();
    sheet.body_face.translation = sheet.body_face.translation * size;
    // The table is seen from 40 degrees above.
    pose_ = {Quat::about({1, 0, 0}, 40 * std::numbers::pi / 180), {}};
    pose_.translation = Vec3d{0, 0, -0.25 * size} - rotate(pose_.rotation, body_.ball->center);
    const RigTable table = *make_rig_table(rig_);
    const Pose probe_sheet = compose(pose_, sheet.body_face);
    const Vec3d up = rotate(probe_sheet.rotation, Vec3d{0, 0, 1});
    const Vec3d center = transformed(pose_, body_.ball->center), lamp = normalized(Vec3d{0.4, 0.6, 0.5});
    const double r = body_.ball->radius_m;
    // Of a point, relative to the centre: toward the lamp, by its distance from the centre.
    const auto toward = [&](Vec3d point) { return lamp - point * (1 / lamp_m); };
    for (const auto& direction : table.lenses[0].direction) {
      const Vec3d ray = normalized(vec_cast<double>(direction));
      const double along = dot(ray, center), inside = r * r - dot(center, center) + along * along;
      double radiance = 0;
      if (inside > 0) {
        const Vec3d normal = (ray * (along - std::sqrt(inside)) - center) * (1 / r);
        const Vec3d to_lamp = toward(normal * r);
        radiance = body_.ball->albedo[0] * (kSky + std::max(0.0, dot(normal, to_lamp)) / std::pow(length(to_lamp), 3));
      } else if (dot(ray, up) < 0) {
        const Vec3d from_center = ray * (dot(probe_sheet.translation, up) / dot(ray, up)) - center;
        const Vec3d to_lamp = toward(from_center), ray_to_lamp = normalized(to_lamp);
        const double past = length(from_center - ray_to_lamp * dot(from_center, ray_to_lamp));
        radiance = 0.1 * (kSky + (past > r ? dot(up, to_lamp) / std::pow(length(to_lamp), 3) : 0));
      }
      pixels_.insert(pixels_.end(), 3, static_cast<float>(radiance / std::numbers::pi));
    }
  }

  [[nodiscard]] Descriptor estimate(std::optional<double> blur_px) const {
    DetectedBody detected;
    detected.probe_body.pose = pose_;
    detected.tags = 1;
    detected.blur_px = blur_px;
    auto estimator = make_marker_estimator(rig_, body_, std::make_unique<GivenBody>(detected), {});
    EXPECT_TRUE(estimator) << estimator.status().message();
    Frame frame;
    frame.info.exposure_s = 1;
    const LensParameters& lens = rig_.lenses[0];
    frame.add_view({0, PixelFormat::rgb_f32, lens.width, lens.height, packed_stride(PixelFormat::rgb_f32, lens.width),
                    std::as_bytes(std::span(pixels_))});
    Descriptor out;
    const Status status = (*estimator)->estimate(std::span(&frame, 1), out);
    EXPECT_TRUE(status.ok()) << status.message();
    return out;
  }

 private:
  static constexpr double kSky = 0.2;  // relative to the lamp's irradiance

  RigParameters rig_;
  MarkerBody body_;
  Pose pose_;
  std::vector<float> pixels_;
};

TEST(MarkerEstimator, ABlurAboveTheLimitOfTheErrorModelIsUnsure) {
  const BallScene scene;
  ASSERT_FALSE(scene.estimate(std::nullopt).flags.has(Flag::unsure));
  EXPECT_FALSE(scene.estimate(kMaxBlur_px - 0.01).flags.has(Flag::unsure));
  EXPECT_TRUE(scene.estimate(kMaxBlur_px + 0.01).flags.has(Flag::unsure));
}

TEST(MarkerEstimator, ABallBesideItsPlaceTurnsDirections) {
  // 0.25 mm are 0.125 rad of a radius of 2 mm, 0.0625 of 4 mm.
  const Descriptor usual = BallScene().estimate(std::nullopt), small = BallScene(0.1).estimate(std::nullopt);
  ASSERT_FALSE(usual.lights.empty());
  ASSERT_FALSE(small.lights.empty());
  for (const std::size_t k : {0U, 2U}) {
    EXPECT_LT(usual.lights[0].direction_covariance[k], 0.04 * 0.04);
    EXPECT_GT(small.lights[0].direction_covariance[k], 0.125 * 0.125);
  }
  EXPECT_FALSE(BallScene(0.2).estimate(std::nullopt).flags.has(Flag::unsure)) << "3.6 degrees";
  EXPECT_TRUE(small.flags.has(Flag::unsure)) << "7 degrees";
}

TEST(MarkerEstimator, ALightSoNearThatItsPositionMattersIsUnsure) {
  // 2 cm are 2.3 degrees at 0.5 m, and 6.4 at 0.18 m.
  const Descriptor far = BallScene(1, 0.5).estimate(std::nullopt), near = BallScene(1, 0.18).estimate(std::nullopt);
  ASSERT_FALSE(near.lights.empty());
  for (const std::size_t k : {0U, 2U}) EXPECT_LT(near.lights[0].direction_covariance[k], 0.06 * 0.06);
  EXPECT_FALSE(far.flags.has(Flag::unsure));
  EXPECT_TRUE(near.flags.has(Flag::unsure));
}

}  // namespace
}  // namespace lightwell::marker
