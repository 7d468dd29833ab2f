// Tests of make_rig_table(): solid angles and overlap weights add up to the covered solid angle.
#include "calibration/model/lens_table.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/equirect.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/response.hpp"

namespace lightwell {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;

LensParameters fisheye(ModelParameters model, double max_angle_rad) {
  LensParameters lens;
  lens.width = 320;
  lens.height = 240;
  lens.model = model;
  lens.max_angle_rad = max_angle_rad;
  lens.pose_cv.rotation = upright_lens_cv();
  return lens;
}

LensParameters kannala_brandt(double max_angle_rad) {
  return fisheye(KannalaBrandtParameters{70, 70, 159.5, 119.5, -0.018, 0.0025, -0.0011, 1e-4}, max_angle_rad);
}

LensParameters double_sphere(double max_angle_rad) {
  return fisheye(DoubleSphereParameters{45, 45, 160.2, 118.9, -0.2, 0.6}, max_angle_rad);
}

LensParameters behind(LensParameters lens) {
  lens.pose_cv.rotation = Quat::about({0, 1, 0}, kPi) * lens.pose_cv.rotation;
  return lens;
}

RigTable table_of(const RigParameters& rig) {
  Result<RigTable> table = make_rig_table(rig);
  EXPECT_TRUE(table.ok()) << table.status().message();
  return std::move(*table);
}

double sum(const LensTable& table) {
  double total = 0;
  for (const float omega : table.solid_angle) total += static_cast<double>(omega);
  return total;
}

TEST(LensTable, OneLensSeesItsCap) {
  for (const double half_field : {40 * kDegree, 90 * kDegree, 95 * kDegree}) {
    for (const LensParameters& lens : {kannala_brandt(half_field), double_sphere(half_field)}) {
      const RigTable table = table_of({{lens}, 0});
      const double cap = 2 * kPi * (1 - std::cos(half_field));
      // At the rim, arcs are replaced by chords of about a pixel: relative error 1 / (6 R²) for a circle of R pixels.
      const auto rim = CameraModel(lens).project({std::sin(half_field), 0, std::cos(half_field)});
      ASSERT_TRUE(rim);
      const double radius_px = rim->x - 160;
      EXPECT_NEAR(table.covered_sr / cap, 1, 1.3 / (6 * radius_px * radius_px));
      EXPECT_NEAR(sum(table.lenses[0]) / table.covered_sr, 1, 1e-6) << "float sum against double sum";
    }
  }
}

TEST(LensTable, APairSeesEverythingOnce) {
  for (const LensParameters& lens : {kannala_brandt(95 * kDegree), double_sphere(95 * kDegree)}) {
    const RigTable table = table_of({{lens, behind(lens)}, 0});
    // Overlap weights have kinks with a slope of 20/rad and are sampled four times per pixel axis, here of 1/70 and
    // 1/45 rad; the error is of second order in that, in the overlap, which is a tenth of the sphere.
    EXPECT_NEAR(table.covered_sr / (4 * kPi), 1, 1.5e-4);
    EXPECT_NEAR(sum(table.lenses[0]), sum(table.lenses[1]), 1e-4);
  }
}

TEST(LensTable, APairWithoutOverlapLeavesAGap) {
  const LensParameters lens = kannala_brandt(80 * kDegree);
  const RigTable table = table_of({{lens, behind(lens)}, 0});
  EXPECT_NEAR(table.covered_sr / (4 * kPi * (1 - std::cos(80 * kDegree))), 1, 3e-5);
  for (const std::int32_t pixel : table.lenses[0].overlap_pixel) ASSERT_EQ(pixel, -1);
}

TEST(LensTable, TheMeanDirectionOfAPairIsZero) {
  const LensParameters lens = kannala_brandt(95 * kDegree);
  const RigTable table = table_of({{lens, behind(lens)}, 0});
  Vec3d mean{};
  for (const LensTable& t : table.lenses) {
    for (std::size_t k = 0; k < t.direction.size(); ++k)
      mean += vec_cast<double>(t.direction[k]) * static_cast<double>(t.solid_angle[k]);
  }
  EXPECT_LT(length(mean) / (4 * kPi), 1e-5);
}

TEST(LensTable, OverlapWeightsFallToZeroTowardsTheRim) {
  constexpr double kFeather = 0.05;
  const LensParameters lens = kannala_brandt(95 * kDegree);
  Result<RigTable> alone = make_rig_table({{lens}, 0}, kFeather);
  Result<RigTable> both = make_rig_table({{lens, behind(lens)}, 0}, kFeather);
  ASSERT_TRUE(alone.ok() && both.ok());
  const LensTable &one = alone->lenses[0], &shared = both->lenses[0];
  const auto weight = [&](double angle) { return std::clamp((95 * kDegree - angle) / kFeather, 0.0, 1.0); };
  int in_overlap = 0;
  for (std::size_t k = 0; k < one.direction.size(); ++k) {
    if (one.solid_angle[k] == 0) continue;
    const double angle = angle_between(vec_cast<double>(one.direction[k]), Vec3d{0, 0, -1});
    const bool overlap = kPi - angle <= 95 * kDegree;
    const double mine = weight(angle), theirs = overlap ? weight(kPi - angle) : 0;
    EXPECT_NEAR(static_cast<double>(shared.solid_angle[k] / one.solid_angle[k]), mine / (mine + theirs), 0.04)
        << "mean over the pixel; a slope change of 20/rad moves it this far from the centre's value";
    in_overlap += overlap ? 1 : 0;
  }
  EXPECT_GT(in_overlap, 1000);
}

TEST(LensTable, OverlapPixelsSeeTheSameDirection) {
  const LensParameters lens = kannala_brandt(95 * kDegree);
  const RigTable table = table_of({{lens, behind(lens)}, 0});
  int count = 0;
  for (std::size_t k = 0; k < table.lenses[0].overlap_pixel.size(); ++k) {
    const std::int32_t pixel = table.lenses[0].overlap_pixel[k];
    if (pixel < 0) continue;
    ++count;
    const Vec3f a = table.lenses[0].direction[k];
    const Vec3f b = table.lenses[1].direction[static_cast<std::size_t>(pixel)];
    // Half the diagonal of a pixel of 1/60 rad, with a margin for pixels that the rim cuts.
    EXPECT_LT(angle_between(a, b), 0.75F / 60);
  }
  EXPECT_GT(count, 1000);
}

TEST(LensTable, EquirectangularSolidAnglesAreExact) {
  LensParameters lens = fisheye(EquirectangularParameters{}, kPi);
  lens.height = 160;
  const RigTable table = table_of({{lens}, 0});
  EXPECT_TRUE(table.lenses[0].equirectangular);
  EXPECT_NEAR(table.covered_sr, 4 * kPi, 1e-12);
  for (int j = 0; j < 160; j += 13) {
    const std::size_t k = static_cast<std::size_t>(j) * 320 + 200;
    EXPECT_FLOAT_EQ(table.lenses[0].solid_angle[k], static_cast<float>(equirect_solid_angle(j, 320, 160)));
    const Vec3d wanted = equirect_direction(200.5 / 320, (j + 0.5) / 160);
    EXPECT_LT(angle_between(vec_cast<double>(table.lenses[0].direction[k]), wanted), 1e-6);
  }
}

TEST(LensTable, PlusXIsRightInTheFirstLensAndLeftInTheSecond) {
  const LensParameters lens = kannala_brandt(95 * kDegree);
  const RigTable table = table_of({{lens, behind(lens)}, 0});
  const std::size_t row = 120 * 320;
  EXPECT_GT(table.lenses[0].direction[row + 200].x, 0.3F);
  EXPECT_LT(table.lenses[0].direction[row + 160].z, -0.99F);
  EXPECT_LT(table.lenses[1].direction[row + 200].x, -0.3F);
  EXPECT_GT(table.lenses[1].direction[row + 160].z, 0.99F);
  for (const LensTable& t : table.lenses)
    EXPECT_GT(t.direction[80 * 320 + 160].y, 0.3F) << "an upper row must be up in the world";
}

TEST(LensTable, RowSpansContainAllVisiblePixels) {
  const RigTable table = table_of({{kannala_brandt(60 * kDegree)}, 0});
  const LensTable& t = table.lenses[0];
  for (int j = 0; j < t.height; ++j) {
    const RowSpan span = t.rows[static_cast<std::size_t>(j)];
    for (int i = 0; i < t.width; ++i) {
      const auto k = static_cast<std::size_t>(j * t.width + i);
      const bool inside = i >= span.first && i < span.end;
      EXPECT_TRUE(inside || t.solid_angle[k] == 0);
      EXPECT_EQ(t.direction[k] == Vec3f{}, t.solid_angle[k] == 0);
    }
  }
  EXPECT_EQ(t.rows[0].end, 0) << "a field of 60 degrees does not fill the picture";
}

TEST(LensTable, VignettingIsInvertedAtEachPixelsAngle) {
  LensParameters lens = kannala_brandt(95 * kDegree);
  lens.photometry.vignetting = {-0.08, 0.005, 0};
  const RigTable table = table_of({{lens}, 0});
  const LensTable& t = table.lenses[0];
  const std::size_t k = 120 * 320 + 250;
  const double angle = angle_between(vec_cast<double>(t.direction[k]), Vec3d{0, 0, -1});
  EXPECT_NEAR(static_cast<double>(t.inverse_vignetting[k]) * vignetting(lens.photometry, angle), 1, 1e-6);
}

TEST(LensTable, RefusesInvalidRigs) {
  EXPECT_EQ(make_rig_table({}).status().code(), StatusCode::invalid_argument);
  const RigParameters rig{{kannala_brandt(1)}, 0};
  EXPECT_EQ(make_rig_table(rig, -1).status().code(), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell
