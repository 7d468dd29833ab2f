// A lux reading recovers clipped lights if the scale is known; otherwise it sets the scale.
#include <numbers>

#include <gtest/gtest.h>

#include "app/pipeline.hpp"
#include "firmware/app/fakes.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::becomes_true;
using test::Lender;

struct Sky {
  std::mutex mutex;
  Units units = Units::absolute;
  bool clipped = true;
  Recovery recovery;
  int recoveries = 0;
};

/// Estimates a sky of radiance 1 with a clipped sun at the zenith.
class SunnyEstimator final : public Estimator {
 public:
  explicit SunnyEstimator(Sky& sky) : sky_(sky) {}
  Status estimate(std::span<const Frame> bracket, Descriptor& out) override {
    const std::lock_guard lock(sky_.mutex);
    out = test::constant_light(1);
    out.sequence = bracket.front().info.sequence;
    out.units = sky_.units;
    out.lights.push_back({{0, 1, 0}, {10, 10, 10}, 0.005F, {}, 3});
    if (sky_.clipped) out.flags.set(Flag::clipped);
    clipped_.clear();
    if (sky_.clipped) clipped_.push_back({3, out.lights[0].irradiance});
    return {};
  }
  EstimatorKind kind() const override { return EstimatorKind::panorama; }
  Status configure(const EstimatorConfig&) override { return {}; }
  void set_scale(RadianceScale scale) override { scale_ = scale; }
  RadianceScale scale() const override { return scale_; }
  std::span<const ClippedLight> clipped_lights() const override { return clipped_; }
  void set_recovery(const Recovery& recovery) override {
    const std::lock_guard lock(sky_.mutex);
    sky_.recovery = recovery;
    ++sky_.recoveries;
  }

 private:
  Sky& sky_;
  std::vector<ClippedLight> clipped_;
  RadianceScale scale_;
};

class PipelineRecovery : public testing::Test {
 protected:
  PipelineRecovery()
      : pipeline_({"roof", 1, 2, "0.1.0", "fake camera"}, std::make_unique<SunnyEstimator>(sky_), EstimatorConfig{}) {}

  void process_one() {
    const std::uint64_t before = pipeline_.status().counters.estimates;
    pipeline_.sink().push(lender_.frame(sequence_++));
    ASSERT_TRUE(becomes_true("the pipeline has processed the frame",
                             [&] { return pipeline_.status().counters.estimates > before; }));
  }

  Lender lender_;
  Sky sky_;
  Pipeline pipeline_;
  std::uint64_t sequence_ = 40;
};

TEST_F(PipelineRecovery, ALuxReadingRecoversTheClippedLight) {
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  const Result<double> factor = pipeline_.report_lux(std::numbers::pi + 5000, {0, 2, 0});
  ASSERT_TRUE(factor.ok()) << factor.status().message();
  EXPECT_EQ(*factor, 1) << "the scale is unchanged";
  process_one();
  const std::lock_guard lock(sky_.mutex);
  EXPECT_EQ(sky_.recoveries, 1);
  ASSERT_EQ(sky_.recovery.count, 1U);
  EXPECT_EQ(sky_.recovery.lights[0].track, 3U);
  EXPECT_NEAR(sky_.recovery.lights[0].irradiance.g, 5000, 50);
}

TEST_F(PipelineRecovery, RefusesUninformativeReadings) {
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  EXPECT_EQ(pipeline_.report_lux(5000, {0, -1, 0}).status().code(), StatusCode::failed_precondition);
  EXPECT_EQ(pipeline_.report_lux(1, {0, 1, 0}).status().code(), StatusCode::invalid_argument);
  EXPECT_EQ(pipeline_.report_lux(std::nan(""), {0, 1, 0}).status().code(), StatusCode::invalid_argument);
  EXPECT_EQ(pipeline_.report_lux(5000, {0, 0, 0}).status().code(), StatusCode::invalid_argument);
  process_one();
  const std::lock_guard lock(sky_.mutex);
  EXPECT_EQ(sky_.recoveries, 0);
}

TEST_F(PipelineRecovery, RefusesToSetTheScaleWhileLightIsClipped) {
  sky_.units = Units::relative;
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  EXPECT_EQ(pipeline_.report_lux(5000, {0, 1, 0}).status().code(), StatusCode::failed_precondition);
}

}  // namespace
}  // namespace lightwell
