#include "estimate/specular/captured_plane.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/specular/plane_pictures.hpp"

namespace lightwell::specular {
namespace {

/// A texture under a mirror image that varies with the direction. The tags' poses are off by 1 mm along the plane's +X.
class CapturedPlaneTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    rig_ = pinhole_rig();
    CaptureOptions options;
    options.texels.edge = 64;
    options.levels = 20, options.lumisphere_levels = 80;
    options.max_bytes = SurfaceLightField::kMinBytes;
    capture_ = std::make_unique<PlaneCapture>(rig_, options);
    estimate::RowReader reader(rig_);
    for (std::uint32_t k = 0; k < 40; ++k) {
      const Pose pose = looking_at_plane(1.4 - 0.02 * k, 0.25 * k, 0.4);
      const PlanePicture picture(pose, [](Vec3d p, Vec3d eye) {
        const double s = 0.2 * std::pow(std::sin(4 * normalized(eye - p).x), 2);
        return smooth_texture(p) + Vec3d{s, s, s};
      });
      ASSERT_TRUE(reader.bind(picture.bracket()).ok());
      UncertainPose tag{pose, {}};
      // The first frame defines the texture's place.
      if (k > 0) tag.pose = compose(pose, Pose{{}, {0.001, 0, 0}});
      for (std::size_t i = 0; i < 3; ++i) tag.covariance[i][i] = 1e-6, tag.covariance[i + 3][i + 3] = 1e-6;
      (void)capture_->add(reader, 0, tag, k, 1);
    }
    capture_->solve(2);
  }
  static void TearDownTestSuite() { capture_.reset(); }

  static CapturedPlane filled(const GlossEstimate* gloss = nullptr, float scale = 1) {
    CapturedPlane out;
    fill_captured_plane(*capture_, gloss, scale, out);
    out.info.capture = 1;
    return out;
  }

  static inline RigParameters rig_;
  static inline std::unique_ptr<PlaneCapture> capture_;
};

TEST_F(CapturedPlaneTest, IsValidForTheWire) {
  const CapturedPlane plane = filled();
  EXPECT_TRUE(captured_plane_problem(plane).ok()) << captured_plane_problem(plane).message();
  EXPECT_EQ(plane.info.size_m, 0.2);
}

TEST_F(CapturedPlaneTest, ACaptureWithoutFramesIsUnseen) {
  CapturedPlane plane;
  fill_captured_plane(PlaneCapture(rig_, {}), nullptr, 1, plane);
  plane.info.capture = 1;
  EXPECT_TRUE(captured_plane_problem(plane).ok()) << captured_plane_problem(plane).message();
  EXPECT_EQ(std::ranges::count(plane.texture.state, SampleState::unseen), 256 * 256);
  EXPECT_EQ(std::ranges::count(plane.lumisphere.state, SampleState::unseen), 7321);
  EXPECT_EQ(std::ranges::count(plane.coverage.seen, std::uint8_t{0}), 7321);
  EXPECT_EQ(plane.info.texture_to_plane, PlaneSimilarity{});
}

TEST_F(CapturedPlaneTest, TextureIsTheDiffuseRadianceTimesTheScale) {
  const CapturedPlane plane = filled(nullptr, 3);
  const TexelImage& diffuse = capture_->separation().diffuse();
  ASSERT_EQ(plane.texture.edge, 64);
  ASSERT_EQ(plane.texture.radiance.size(), diffuse.size());
  std::size_t measured = 0;
  for (std::size_t k = 0; k < diffuse.size(); ++k) {
    EXPECT_EQ(plane.texture.state[k] == SampleState::measured, diffuse[k].measured());
    if (!diffuse[k].measured()) continue;
    EXPECT_EQ(plane.texture.radiance[k].g, std::max(0.0F, 3 * diffuse[k].g));
    ++measured;
  }
  EXPECT_GT(measured, diffuse.size() / 2);
}

TEST_F(CapturedPlaneTest, EveryNodeHasTheSpecularRadianceOfItsDirection) {
  const CapturedPlane plane = filled(nullptr, 2);
  const Lumisphere& specular = capture_->separation().specular();
  ASSERT_EQ(specular.grid.levels(), 80);
  ASSERT_EQ(plane.lumisphere.grid.levels(), 40);
  std::size_t measured = 0, negative = 0;
  for (std::size_t n = 0; n < plane.lumisphere.grid.size(); ++n) {
    // The nodes of half the levels are among those of all.
    const std::uint32_t from = specular.grid.nearest(vec_cast<float>(plane.lumisphere.grid.direction(n)));
    ASSERT_LT(length(specular.grid.direction(from) - plane.lumisphere.grid.direction(n)), 1e-6);
    EXPECT_EQ(plane.lumisphere.radiance[n].r, std::max(0.0F, 2 * specular.value[from].r)) << "node " << n;
    if (plane.lumisphere.state[n] == SampleState::measured) ++measured;
    if (specular.value[from].r < 0) ++negative;
    EXPECT_EQ(plane.lumisphere.state[n] == SampleState::unseen, !(specular.weight[from] > 0));
  }
  EXPECT_GT(measured, 100U);
  EXPECT_GT(negative, 0U) << "the case of negative radiance does not occur";
}

TEST_F(CapturedPlaneTest, UnseenNodesHaveTheReflectionOfTheLightThatWasFound) {
  GlossEstimate gloss;
  gloss.glossy = true;
  gloss.environment.grid = HemisphereGrid(30);
  gloss.reflection.assign(gloss.environment.grid.size(), Radiance{0.5F, 0.25F, -1});
  const CapturedPlane plane = filled(&gloss, 2), without = filled(nullptr, 2);
  int unseen = 0;
  for (std::size_t n = 0; n < plane.lumisphere.grid.size(); ++n) {
    ASSERT_EQ(plane.lumisphere.state[n], without.lumisphere.state[n]);
    if (plane.lumisphere.state[n] != SampleState::unseen) {
      EXPECT_EQ(plane.lumisphere.radiance[n], without.lumisphere.radiance[n]);
      continue;
    }
    ++unseen;
    EXPECT_NEAR(plane.lumisphere.radiance[n].r, 1, 1e-6);
    EXPECT_NEAR(plane.lumisphere.radiance[n].g, 0.5, 1e-6);
    EXPECT_EQ(plane.lumisphere.radiance[n].b, 0);
  }
  EXPECT_GT(unseen, 100);
  gloss.provisional = true;
  EXPECT_EQ(filled(&gloss, 2).lumisphere.radiance, without.lumisphere.radiance);
}

TEST_F(CapturedPlaneTest, AGuessBetweenSaturatedDirectionsIsUnseen) {
  CaptureOptions options;
  options.texels.edge = 64, options.levels = 20, options.lumisphere_levels = 40, options.refine_pose = false;
  PlaneCapture capture(rig_, options);
  estimate::RowReader reader(rig_);
  // Above what a float frame may hold, which counts as saturated.
  constexpr double kSaturated = 1e31;
  std::uint32_t frame = 0;
  const auto add = [&](double elevation, double azimuth, double specular) {
    const Pose pose = looking_at_plane(elevation, azimuth, 0.4);
    const PlanePicture picture(pose, [=](Vec3d p, Vec3d) {
      return smooth_texture(p) + Vec3d{specular, specular, specular};
    });
    ASSERT_TRUE(reader.bind(picture.bracket()).ok());
    (void)capture.add(reader, 0, UncertainPose{pose, {}}, frame++, 1);
  };
  for (int k = 0; k < 20; ++k) add(1.3, 0.3 * k, 0);
  for (int k = 0; k < 10; ++k)
    for (const double elevation : {1.0, 0.4}) add(elevation, 0.05 * k, kSaturated);
  capture.solve(2);
  CapturedPlane plane;
  fill_captured_plane(capture, nullptr, 1, plane);
  const Lumisphere& specular = capture.separation().specular();
  int guessed = 0;
  for (std::size_t n = 0; n < plane.lumisphere.grid.size(); ++n) {
    ASSERT_EQ(plane.lumisphere.state[n] == SampleState::unseen, !(specular.weight[n] > 0)) << "node " << n;
    guessed += specular.clipped[n] != 0 && !(specular.weight[n] > 0) ? 1 : 0;
  }
  EXPECT_GT(guessed, 0) << "no gap between saturated directions";
  EXPECT_GT(std::ranges::count(plane.lumisphere.state, SampleState::clipped), 0);
}

TEST_F(CapturedPlaneTest, CoverageIsTheNodesOfTheLightField) {
  const CapturedPlane plane = filled();
  std::vector<std::uint8_t> expected(capture_->light_field().grid().size());
  const int tiles = capture_->light_field().texels().tiles();
  for (int tile = 0; tile < tiles * tiles; ++tile)
    capture_->light_field().for_each_page(tile, [&](const LightFieldPage& page) {
      if (page.filled != 0) expected[page.node] = 1;
    });
  EXPECT_EQ(plane.coverage.grid.levels(), 20);
  EXPECT_EQ(plane.coverage.seen, expected);
  EXPECT_GT(std::ranges::count(expected, std::uint8_t{1}), 50);
  EXPECT_GT(std::ranges::count(expected, std::uint8_t{0}), 50);
}

TEST_F(CapturedPlaneTest, TextureToPlaneIsTheAlignment) {
  const CapturedPlane plane = filled();
  const TextureAlignment alignment = capture_->alignment();
  // Refined poses are of the texture, tags see the plane 1 mm further along its +X.
  EXPECT_NEAR(plane.info.texture_to_plane.x_m, -0.001, 0.0003);
  for (const Vec3d p : {Vec3d{0.1, 0.1, 0}, Vec3d{-0.1, 0.05, 0}}) {
    const Vec3d expected = alignment.texture_point(p);
    const PlanePoint texture = plane.info.texture_to_plane.texture_point({p.x, p.y});
    // Of second order.
    EXPECT_NEAR(texture.x, expected.x, 2e-5);
    EXPECT_NEAR(texture.y, expected.y, 2e-5);
  }
}

TEST_F(CapturedPlaneTest, GlossIsThatOfAGlossyPlane) {
  GlossEstimate gloss;
  gloss.alpha = 0.25;
  EXPECT_FALSE(filled(&gloss).info.gloss_alpha);
  EXPECT_FALSE(filled().info.f0);
  gloss.glossy = true;
  EXPECT_EQ(filled(&gloss).info.gloss_alpha, 0.25F);
  EXPECT_EQ(filled(&gloss).info.f0, 0.04F);
  CapturedPlane again = filled(&gloss);
  fill_captured_plane(*capture_, nullptr, 1, again);
  EXPECT_FALSE(again.info.gloss_alpha);
}

TEST_F(CapturedPlaneTest, ReusesItsMemoryAndLeavesIdentityAndPose) {
  CapturedPlane plane = filled();
  plane.info.capture = 77;
  plane.info.units = Units::absolute;
  plane.info.mid_exposure = {5};
  plane.info.T_probe_plane = Pose{{}, {1, 2, 3}};
  const Radiance* const texture = plane.texture.radiance.data();
  const Radiance* const lumisphere = plane.lumisphere.radiance.data();
  const std::uint8_t* const seen = plane.coverage.seen.data();
  fill_captured_plane(*capture_, nullptr, 1, plane);
  EXPECT_EQ(plane.texture.radiance.data(), texture);
  EXPECT_EQ(plane.lumisphere.radiance.data(), lumisphere);
  EXPECT_EQ(plane.coverage.seen.data(), seen);
  EXPECT_EQ(plane.info.capture, 77U);
  EXPECT_EQ(plane.info.units, Units::absolute);
  EXPECT_EQ(plane.info.mid_exposure, ProbeTime{5});
  EXPECT_EQ(plane.info.T_probe_plane, (Pose{{}, {1, 2, 3}}));
}

TEST_F(CapturedPlaneTest, AScaleThatIsNotFiniteIsRefused) {
  EXPECT_FALSE(captured_plane_problem(filled(nullptr, std::numeric_limits<float>::quiet_NaN())).ok());
  EXPECT_FALSE(captured_plane_problem(filled(nullptr, std::numeric_limits<float>::infinity())).ok());
}

}  // namespace
}  // namespace lightwell::specular
