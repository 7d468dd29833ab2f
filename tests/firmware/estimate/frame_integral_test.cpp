// The values between the steps of the panorama estimator: FrameIntegral and DetectedLights.
#include <cmath>
#include <span>
#include <vector>

#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/light_finder.hpp"
#include "estimate/panorama/sphere_integrator.hpp"
#include "scenes.hpp"

namespace lightwell::estimate {
namespace {

using namespace testing_scenes;

constexpr int kEdge = 4;

/// The first two steps of an estimate.
class Steps {
 public:
  explicit Steps(const RigParameters& rig)
      : rig_(rig),
        table_(*make_rig_table(rig)),
        reader_(rig_, table_),
        integrator_(rig_, table_, kEdge),
        finder_(table_, integrator_.layout(), integrator_.grid()) {}

  const FrameIntegral& integrate(const Frame& frame, UnseenFill fill) {
    const std::span bracket(&frame, 1);
    const Status s = reader_.bind(bracket);
    EXPECT_TRUE(s.ok()) << s.message();
    return integrator_.integrate(reader_, bracket, fill, {});
  }
  const DetectedLights& find_lights(const FrameIntegral& integral, int max_lights) {
    (void)finder_.find_brightest(reader_, integral, everything());
    return finder_.find_others(reader_, max_lights);
  }
  [[nodiscard]] const SphereIntegrator& integrator() const { return integrator_; }

 private:
  RigParameters rig_;
  RigTable table_;
  RowReader reader_;
  SphereIntegrator integrator_;
  LightFinder finder_;
};

double luminance(std::span<const CellSum> sums) {
  double total = 0;
  for (const CellSum& s : sums) total += s.luminance();
  return total;
}

Radiance uniform(Vec3d /*direction*/) { return {2, 2, 2}; }

TEST(FrameIntegral, OfAUniformSphere) {
  const RigParameters rig = rig_of("pair", 240, 180);
  Steps steps(rig);
  const Picture picture = picture_of(rig, uniform);
  const FrameIntegral& integral = steps.integrate(picture.frame, UnseenFill::mirror);
  EXPECT_NEAR(integral.observed_sr, kSphere, 0.005 * kSphere);
  EXPECT_NEAR(integral.mean_luminance, 2, 1e-4);
  EXPECT_NEAR(luminance(integral.blocks.sum), 2 * integral.observed_sr, 1e-3);
  EXPECT_NEAR(integral.projection.c[0][1], 2 * std::sqrt(kSphere), 0.005 * 2 * std::sqrt(kSphere));
  EXPECT_FALSE(integral.filled);
  EXPECT_TRUE(steps.find_lights(integral, 8).lights.empty());
}

TEST(FrameIntegral, AMissingLensIsZeroOrFilled) {
  const RigParameters rig = rig_of("pair", 240, 180);
  Steps steps(rig);
  const Picture picture = picture_of(rig, uniform);
  Frame first_lens;
  first_lens.info = picture.frame.info;
  first_lens.add_view(picture.frame.views()[0]);
  const std::size_t first_missing = steps.integrator().layout().first(1);
  for (const UnseenFill fill : {UnseenFill::none, UnseenFill::mirror}) {
    const FrameIntegral& integral = steps.integrate(first_lens, fill);
    EXPECT_NEAR(integral.observed_sr, kSphere / 2, 0.01 * kSphere);
    EXPECT_NEAR(integral.mean_luminance, 2, 1e-4) << "of the observed directions";
    const double missing = luminance(std::span(integral.blocks.sum).subspan(first_missing));
    EXPECT_NEAR(missing, fill == UnseenFill::none ? 0 : kSphere, 0.02 * kSphere);
    EXPECT_EQ(integral.filled, fill == UnseenFill::mirror);
  }
}

TEST(FrameIntegral, DoesNotDependOnTheFillingOfTheFrameBefore) {
  const RigParameters rig = rig_of("single", 240, 180);
  Steps steps(rig);
  const Picture picture = picture_of(rig, uniform);
  const FrameIntegral& integral = steps.integrate(picture.frame, UnseenFill::mirror);
  ASSERT_GT(luminance(integral.unseen), 0);
  for (const UnseenFill fill : {UnseenFill::average, UnseenFill::none}) {
    (void)steps.integrate(picture.frame, UnseenFill::mirror);
    const FrameIntegral& next = steps.integrate(picture.frame, fill);
    EXPECT_FALSE(next.filled);
    EXPECT_EQ(luminance(next.unseen), 0) << "cells that no lens sees have no average";
  }
}

TEST(DetectedLights, SubtractLeavesTheSurroundings) {
  const RigParameters rig = rig_of("pair", 240, 180);
  Steps steps(rig);
  const Picture picture = picture_of(rig, lamp({0.3, 0.5, -1}, 0.06, 500));
  const FrameIntegral& integral = steps.integrate(picture.frame, UnseenFill::mirror);
  const DetectedLights& found = steps.find_lights(integral, 8);
  ASSERT_EQ(found.lights.size(), 1U);
  EXPECT_EQ(found.required, 0) << "its peak is hundreds of times the mean";
  std::vector<CellSum> residual = integral.blocks.sum;
  found.subtract(0, residual);
  // The cap is small: its irradiance at normal incidence is nearly the integral of its radiance.
  EXPECT_NEAR(luminance(integral.blocks.sum) - luminance(residual), found.lights[0].irradiance.luminance(),
              0.01 * found.lights[0].irradiance.luminance());
  const float ambient = luminance_of(1.0F, 0.9F, 0.8F);
  const CellGrid& grid = steps.integrator().grid();
  for (std::size_t block = 0; block < residual.size(); ++block)
    EXPECT_LE(residual[block].luminance(), 1.01F * ambient * grid.solid_angle(block) + 1e-5F) << block;
}

TEST(DetectedLights, AreAtMostTheNumberSearchedFor) {
  const RigParameters rig = rig_of("pair", 240, 180);
  Steps steps(rig);
  const RadianceOf left = lamp({-1, 0.2, -1}, 0.06, 500), right = lamp({1, 0.2, -1}, 0.06, 400);
  const Picture picture = picture_of(rig, [&](Vec3d d) {
    const Radiance a = left(d), b = right(d);
    return Radiance{a.r + b.r, a.g + b.g, a.b + b.b};
  });
  const FrameIntegral& integral = steps.integrate(picture.frame, UnseenFill::mirror);
  EXPECT_EQ(steps.find_lights(integral, 8).lights.size(), 2U);
  const DetectedLights& one = steps.find_lights(integral, 1);
  ASSERT_EQ(one.lights.size(), 1U);
  EXPECT_LT(one.lights[0].direction.x, 0) << "the brighter one";
  EXPECT_EQ(one.required, 0);
  const DetectedLights& none = steps.find_lights(integral, 0);
  EXPECT_TRUE(none.lights.empty());
  EXPECT_EQ(none.required, -1);
}

}  // namespace
}  // namespace lightwell::estimate
