// Motion between the exposures of a bracket is detected, lamps are measured once, and static scenes cause no alarm.
#include <cmath>
#include <numbers>

#include "brackets.hpp"
#include "estimate/panorama/bracket_pass.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

const std::vector<double> kThree{1e-5, 3.3e-4, 5e-3};

Vec3d lamp_at(double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return {std::sin(a) * 0.9, 0.35, -std::cos(a) * 0.9};
}

class Motion : public testing::TestWithParam<PixelFormat> {
 protected:
  Motion() : rig_(rig_of("pair", 320, 240, GetParam())), table_(*make_rig_table(rig_)) {
    EstimatorConfig config;
    config.panorama.smoothing = Smoothing::none;
    estimator_ = estimator_of(rig_, config);
  }

  Descriptor estimated(const std::vector<RadianceOf>& scenes, std::uint64_t number = 0) {
    const Bracket bracket = bracket_of(rig_, table_, GetParam(), scenes, kThree, number);
    Descriptor d;
    const Status s = estimator_->estimate(bracket.frames, d);
    EXPECT_TRUE(s.ok()) << s.message();
    return d;
  }

  RigParameters rig_;
  RigTable table_;
  std::unique_ptr<Estimator> estimator_;
};

TEST_P(Motion, StaticNoisyScenesHaveNoMotion) {
  const estimate::BlockLayout layout(table_, 8);
  estimate::BracketPass pass(rig_, table_, layout);
  estimate::BlockSums sums(layout);
  std::size_t excluded_blocks = 0, blocks = 0;
  for (int frame = 0; frame < 24; ++frame) {
    const RadianceOf scene = furnished_room(lamp_at(11.0 * frame), 30.0F * static_cast<float>(1 + frame));
    const Bracket bracket =
        bracket_of(rig_, table_, GetParam(), std::vector(3, scene), kThree, static_cast<std::uint64_t>(frame));
    pass.run(bracket.frames, {}, {}, sums);
    double light = 0;
    for (std::size_t i = 0; i < layout.size(); ++i) {
      excluded_blocks += sums.exposures[i] != 3 ? 1 : 0;
      light += sums.sum[i].luminance();
    }
    blocks += layout.size();
    EXPECT_LT(sums.motion_luminance, 1e-3 * light) << "a fifth of the threshold of the flag, in frame " << frame;
  }
  EXPECT_LT(static_cast<double>(excluded_blocks), 1e-3 * static_cast<double>(blocks));
}

TEST_P(Motion, MovingLampIsMeasuredOnceByTheShortestExposure) {
  for (const double step : {3.0, 20.0}) {
    for (const double from : {0.0, 50.0, 175.0}) {
      SCOPED_TRACE(std::to_string(step) + " from " + std::to_string(from));
      const std::vector<RadianceOf> scenes{furnished_room(lamp_at(from)), furnished_room(lamp_at(from + step)),
                                           furnished_room(lamp_at(from + 2 * step))};
      const Descriptor d = estimated(scenes), still = estimated(std::vector(3, scenes[0]));
      EXPECT_TRUE(d.flags.has(Flag::moved));
      EXPECT_FALSE(still.flags.has(Flag::moved));
      ASSERT_FALSE(d.lights.empty());
      EXPECT_LT(degrees_between(d.lights[0].direction, lamp_at(from)), 0.5);
      ASSERT_FALSE(still.lights.empty());
      EXPECT_NEAR(d.lights[0].irradiance.g, still.lights[0].irradiance.g, 0.03 * still.lights[0].irradiance.g);
      // Not doubled: the same irradiance as from the scene of the shortest exposure.
      EXPECT_NEAR(irradiance_at(d, d.lights[0].direction).g, irradiance_at(still, d.lights[0].direction).g,
                  0.04 * irradiance_at(still, d.lights[0].direction).g);
    }
  }
}

TEST_P(Motion, LampSwitchedBetweenExposuresIsFlagged) {
  const RadianceOf on = furnished_room(lamp_at(20)), off = furnished_room(lamp_at(20), 0);
  for (int pattern = 1; pattern < 7; ++pattern) {
    SCOPED_TRACE(pattern);
    std::vector<RadianceOf> scenes;
    for (int e = 0; e < 3; ++e) scenes.push_back((pattern >> e & 1) != 0 ? on : off);
    const Descriptor d = estimated(scenes);
    // In the longest exposure alone (pattern 4), the lower bound is only twice the wall's radiance: too little for a
    // flag.
    EXPECT_TRUE(d.flags.has(Flag::moved) || pattern == 4);
    const bool lit = (pattern & 1) != 0;
    const bool found = !d.lights.empty() && degrees_between(d.lights[0].direction, lamp_at(20)) < 1;
    EXPECT_EQ(found, lit) << "the state during the shortest exposure";
  }
}

TEST_P(Motion, StaticBlocksUseAllExposures) {
  const std::vector<RadianceOf> scenes{furnished_room(lamp_at(0)), furnished_room(lamp_at(6)),
                                       furnished_room(lamp_at(12))};
  const estimate::BlockLayout layout(table_, 8);
  estimate::BracketPass pass(rig_, table_, layout);
  estimate::BlockSums sums(layout);
  const Bracket bracket = bracket_of(rig_, table_, GetParam(), scenes, kThree);
  pass.run(bracket.frames, {}, {}, sums);
  std::size_t excluded_blocks = 0;
  for (std::size_t i = 0; i < layout.size(); ++i) excluded_blocks += sums.exposures[i] != 3 ? 1 : 0;
  EXPECT_GE(excluded_blocks, 2U);
  EXPECT_LT(excluded_blocks, layout.size() / 20);
}

INSTANTIATE_TEST_SUITE_P(EveryFormat, Motion,
                         testing::Values(PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv,
                                         PixelFormat::bayer_rggb8, PixelFormat::bayer_rggb12),
                         [](const auto& p) { return std::string(to_string(p.param)); });

}  // namespace
}  // namespace lightwell
