// Outlines of shadows and the geometry of the path-traced trials, against closed forms.
#include "measure/viewer_trials.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace lightwell::measure {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kPixel_m = 0.0007;

/// A disc of value 0 on 1, with an edge of two pixels that is linear across.
GreyPicture disc(double x, double y, double radius) {
  GreyPicture out(80, 60);
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i)
      out.at(i, j) = std::clamp((std::hypot(i - x, j - y) - radius + 1) / 2, 0.0, 1.0);
  return out;
}

TEST(Contour, OfADiscIsACircle) {
  const std::vector<Segment> outline = contour(disc(40.3, 30.6, 17.4), 0.5);
  double around = 0;
  for (const Segment& s : outline) {
    EXPECT_NEAR(std::hypot(s.from.x - 40.3, s.from.y - 30.6), 17.4, 0.02);
    around += std::hypot(s.to.x - s.from.x, s.to.y - s.from.y);
  }
  EXPECT_NEAR(around, 2 * std::numbers::pi * 17.4, 0.5);
}

TEST(Contour, LeavesOutWhatDoesNotCount) {
  GreyPicture picture = disc(40, 30, 15);
  for (int j = 0; j < picture.height; ++j)
    for (int i = 0; i < 40; ++i) picture.at(i, j) = std::nan("");
  const std::vector<Segment> outline = contour(picture, 0.5);
  ASSERT_FALSE(outline.empty());
  for (const Segment& s : outline) EXPECT_GE(s.from.x, 40);
}

TEST(OutlineDistance, OfConcentricCirclesIsTheDifferenceOfTheirRadii) {
  const auto a = contour(disc(40, 30, 12), 0.5), b = contour(disc(40, 30, 14.5), 0.5);
  const OutlineDistance d = outline_distance(a, b);
  EXPECT_NEAR(d.median_px, 2.5, 0.03);
  EXPECT_NEAR(d.percentile_95_px, 2.5, 0.05);
  EXPECT_NEAR(outline_distance(a, a).percentile_95_px, 0, 1e-9);
}

TEST(OutlineDistance, OfAMovedCircleHasItsShiftAtTheSides) {
  const OutlineDistance d = outline_distance(contour(disc(40, 30, 12), 0.5), contour(disc(42, 30, 12), 0.5));
  EXPECT_NEAR(d.percentile_95_px, 2, 0.05);
  EXPECT_NEAR(d.median_px, std::sqrt(2.0), 0.1);
}

TEST(OutlineDistance, WithoutAnOutlineIsNotANumber) {
  EXPECT_TRUE(std::isnan(outline_distance({}, contour(disc(40, 30, 12), 0.5)).median_px));
}

class Trials : public testing::Test {
 protected:
  void SetUp() override {
    Result<TrialSetup> loaded = load_trial_setup(LIGHTWELL_VIEWER_TRIALS);
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    setup = *loaded;
  }

  /// The light ratio around the object for a distant lamp in this direction: the hull of foot and shadow of the top.
  [[nodiscard]] GreyPicture shadow_picture(double azimuth_deg, double elevation_deg, double umbra) const {
    const double length = setup.object_height_m / std::tan(elevation_deg * kDegree), a = azimuth_deg * kDegree;
    const Vec3d tip{-length * std::sin(a), 0, -length * std::cos(a)};
    GreyPicture out(setup.width, setup.height, std::nan(""));
    const std::vector<Seen> seen = seen_by(setup);
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x) {
        const auto p = setup.on_table(x, y);
        const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(x);
        if (!p || seen[i] != Seen::table || std::hypot(p->x, p->z) > shadow_reach_m(length)) continue;
        const double t = std::clamp(dot(*p, tip) / dot(tip, tip), 0.0, 1.0);
        // Edges as wide as a pixel, as pixels that a camera averages over.
        const double outside = std::hypot(p->x - t * tip.x, p->z - t * tip.z) - setup.object_radius_m;
        out.at(x, y) = umbra + (1 - umbra) * std::clamp(outside / kPixel_m + 0.5, 0.0, 1.0);
      }
    return box_means(out, 1);
  }

  TrialSetup setup;
};

TEST_F(Trials, CameraLooksAtTheObject) {
  EXPECT_TRUE(setup.on_object(setup.cx, setup.cy));
  // The camera's axis passes 2 cm above the object's foot.
  const Vec3d d = setup.ray(setup.cx, setup.cy), eye = setup.T_world_camera.translation;
  const Vec3d above_foot = eye + d * (-eye.z / d.z);
  EXPECT_NEAR(above_foot.x, 0, 1e-9);
  EXPECT_NEAR(above_foot.y, 0.02, 1e-6);
  const auto right = setup.on_table(setup.cx + 100, setup.cy), lower = setup.on_table(setup.cx, setup.cy + 100);
  ASSERT_TRUE(right && lower);
  EXPECT_GT(right->x, 0.03) << "to the right is +X";
  EXPECT_GT(lower->z, 0.03) << "towards the viewer is +Z";
}

TEST_F(Trials, DirectionOfALampIsFoundFromItsShadow) {
  for (const double azimuth : {-127.6, 27.5, 203.4})
    for (const double elevation : {23.4, 52.4}) {
      const auto shadow = shadow_of(setup, shadow_picture(azimuth, elevation, 0.4));
      ASSERT_TRUE(shadow) << azimuth << ", " << elevation;
      EXPECT_NEAR(shadow->depth, 0.6, 0.01);
      // Half a pixel: of a short shadow the object hides a side of the tip. Real and virtual shadows have it alike.
      EXPECT_NEAR(shadow->elevation_deg, elevation, 0.3) << azimuth;
      EXPECT_NEAR(angle_difference_deg(shadow->azimuth_deg, azimuth), 0, 0.8) << azimuth << ", " << elevation;
    }
}

TEST_F(Trials, WithoutShadowThereIsNone) {
  EXPECT_FALSE(shadow_of(setup, shadow_picture(90, 45, 0.98)));
  EXPECT_FALSE(shadow_of(setup, GreyPicture(10, 10, std::nan(""))));
}

TEST_F(Trials, FoldersWithoutTrialsAreNamed) {
  const auto missing = load_viewer_trials("/nowhere");
  EXPECT_EQ(missing.status().code(), StatusCode::not_found);
  EXPECT_NE(missing.status().message().find("/nowhere/trials.jsonl"), std::string::npos);
}

}  // namespace
}  // namespace lightwell::measure
