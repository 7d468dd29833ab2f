// SpecularEstimator with given poses, on short rendered sequences: its contract, matte planes, extreme frames.
#include "estimate/specular/specular_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measure/specular_sequences.hpp"

namespace lightwell {
namespace {

using measure::SpecularSequence;
using testing::HasSubstr;

/// Returns what the test says.
class GivenPlane final : public BodyFinder {
 public:
  explicit GivenPlane(const Result<std::optional<DetectedBody>>& answer) : answer_(answer) {}
  void set_decimation(const FinderDecimation&) override {}
  Result<std::optional<DetectedBody>> find(const View&, const FrameInfo&) override { return answer_; }
  void answer(const Result<std::optional<DetectedBody>>& a) { answer_ = a; }

 private:
  Result<std::optional<DetectedBody>> answer_;
};

GlossyPlane plane() {
  GlossyPlane out;
  out.name = "book", out.side_m = SpecularSequence::kPlane_m, out.tag_size_m = 0.03;
  out.tags.push_back({0, {}});
  return out;
}

SpecularOptions small_options() {
  SpecularOptions out;
  out.probe_id = 77;
  out.capture.texels.edge = 128;
  out.capture.max_bytes = 60U << 20U;
  out.capture.refine_pose = false;  // Poses are true.
  return out;
}

class SpecularEstimatorTest : public ::testing::Test {
 protected:
  static constexpr int kFrames = 120;

  static void SetUpTestSuite() {
    measure::SpecularSequenceOptions options;
    options.name = "lamps", options.alpha = 0.1, options.seed = 3, options.frames = kFrames;
    options.width = 320, options.height = 240, options.focal_px = 280;
    sequence_ = std::move(*SpecularSequence::make(options));
  }
  static void TearDownTestSuite() { sequence_.reset(); }

  SpecularEstimatorTest() { make(small_options()); }
  void make(const SpecularOptions& options) {
    auto finder = std::make_unique<GivenPlane>(std::optional<DetectedBody>());
    finder_ = finder.get();
    auto made = make_specular_estimator(sequence_->rig(), plane(), std::move(finder), options);
    ASSERT_TRUE(made) << made.status().message();
    estimator_ = std::move(*made);
  }

  static DetectedBody true_pose(int k) {
    DetectedBody out;
    out.probe_body.pose = sequence_->true_pose(k);
    for (std::size_t i = 0; i < 6; ++i) out.probe_body.covariance[i][i] = i < 3 ? 1e-8 : 1e-10;
    out.tags = 4;
    return out;
  }
  /// Frame k with its true pose.
  Status estimate(const measure::Shot& shot, int k) {
    finder_->answer(std::optional(true_pose(k)));
    return estimator_->estimate(shot.frames, descriptor_);
  }
  /// Frame k of the sequence's plane without its specular part.
  static measure::Shot matte_frame(int k) {
    reference::GlossyScene scene = sequence_->scene();
    scene.specular = nullptr;
    const Pose p = sequence_->true_pose(k);
    // The reference's camera looks along +Z, the probe along -Z.
    const Pose camera = compose(inverse(sequence_->rig().lenses[0].pose_cv), p);
    const Quat& q = camera.rotation;
    const auto column = [&](Vec3d axis) {
      const Vec3d v = rotate(q, axis);
      return reference::V3{v.x, v.y, v.z};
    };
    const reference::V3 x = column({1, 0, 0}), y = column({0, 1, 0}), z = column({0, 0, 1});
    const reference::Pose pose{
        {reference::V3{x.x, y.x, z.x}, reference::V3{x.y, y.y, z.y}, reference::V3{x.z, y.z, z.z}},
        {camera.translation.x, camera.translation.y, camera.translation.z}};
    const reference::GlossyView view = reference::render_view(scene, sequence_->pinhole(), pose, 2);
    measure::LensRadiance radiance(1);
    for (const double v : view.rgb) radiance[0].push_back(static_cast<float>(v / SpecularSequence::kExposure_s));
    static const measure::Camera shutter(sequence_->rig(), PixelFormat::rgb8);
    return shutter.expose(radiance, std::vector<double>{SpecularSequence::kExposure_s}, static_cast<std::uint64_t>(k));
  }
  static measure::Shot even_frame(int k, std::byte code) {
    measure::Shot shot = sequence_->frame(k);
    std::fill(shot.pixels[0].begin(), shot.pixels[0].end(), code);
    return shot;
  }
  /// Neither NaN nor negative, and marked as a guess.
  void expect_flagged() const {
    EXPECT_TRUE(descriptor_.flags.has(Flag::unseen));
    EXPECT_TRUE(descriptor_.flags.has(Flag::unsure));
    EXPECT_EQ(descriptor_.bound.total, std::numeric_limits<float>::infinity());
    EXPECT_TRUE(descriptor_.lights.empty());
    for (const Radiance& c : descriptor_.radiance.c) EXPECT_TRUE(std::isfinite(c.r + c.g + c.b));
  }

  static inline std::unique_ptr<SpecularSequence> sequence_;
  std::unique_ptr<SpecularEstimator> estimator_;
  GivenPlane* finder_ = nullptr;
  Descriptor descriptor_;
};

TEST_F(SpecularEstimatorTest, RefusesWhatIsInvalid) {
  const auto refusal = [](const RigParameters& rig, const GlossyPlane& p, std::unique_ptr<BodyFinder> finder,
                          const SpecularOptions& options) {
    const Status s = make_specular_estimator(rig, p, std::move(finder), options).status();
    EXPECT_EQ(s.code(), StatusCode::invalid_argument);
    return s.message();
  };
  const auto finder = [] { return std::make_unique<GivenPlane>(std::optional<DetectedBody>()); };
  EXPECT_THAT(refusal(sequence_->rig(), plane(), nullptr, {}), HasSubstr("finder"));
  RigParameters no_width = sequence_->rig();
  no_width.lenses[0].width = 0;
  EXPECT_NE(refusal(no_width, plane(), finder(), {}), "");
  GlossyPlane no_side = plane();
  no_side.side_m = 0;
  EXPECT_THAT(refusal(sequence_->rig(), no_side, finder(), {}), HasSubstr("side_m"));
  SpecularOptions options;
  options.frames_between_estimates = 0;
  EXPECT_THAT(refusal(sequence_->rig(), plane(), finder(), options), HasSubstr("frames_between_estimates"));
  options = {};
  options.light_operations = 0;
  EXPECT_THAT(refusal(sequence_->rig(), plane(), finder(), options), HasSubstr("light_operations"));
  options = {};
  options.config.panorama.epsilon = 0.5;
  EXPECT_THAT(refusal(sequence_->rig(), plane(), finder(), options), HasSubstr("panorama.epsilon"));
  options = {};
  options.config.specular.environment_edge = 7;
  EXPECT_THAT(refusal(sequence_->rig(), plane(), finder(), options), HasSubstr("environment_edge"));
  for (const int edge : {0, 4, 33, 260}) {
    options = {};
    options.capture.texels.edge = edge;
    EXPECT_THAT(refusal(sequence_->rig(), plane(), finder(), options), HasSubstr("texels.edge"));
  }
}

TEST_F(SpecularEstimatorTest, ConfigureRefusesOtherEstimatorsOptions) {
  EXPECT_EQ(estimator_->kind(), EstimatorKind::specular);
  EstimatorConfig other;
  other.marker.max_faces = 3;
  EXPECT_EQ(estimator_->configure(other).code(), StatusCode::invalid_argument);
  other = {};
  other.panorama.environment_edge = 16;
  EXPECT_THAT(estimator_->configure(other).message(), HasSubstr("panorama.environment_edge"));
  EstimatorConfig own;
  own.band = 2, own.max_lights = 1, own.specular.environment_edge = 16;
  EXPECT_TRUE(estimator_->configure(own).ok());
  ASSERT_TRUE(estimate(sequence_->frame(0), 0).ok());
  EXPECT_LE(descriptor_.radiance.band, 2);
}

TEST_F(SpecularEstimatorTest, WithoutTagsOrFrameThereIsNoAnswer) {
  const measure::Shot shot = sequence_->frame(0);
  const Status none = estimator_->estimate(shot.frames, descriptor_);
  EXPECT_EQ(none.code(), StatusCode::not_found);
  EXPECT_THAT(none.message(), HasSubstr("'book'"));
  finder_->answer(Status(StatusCode::invalid_argument, "unreadable"));
  EXPECT_EQ(estimator_->estimate(shot.frames, descriptor_).code(), StatusCode::invalid_argument);
  finder_->answer(std::optional(true_pose(0)));
  EXPECT_EQ(estimator_->estimate({}, descriptor_).code(), StatusCode::invalid_argument);
  // Behind the camera: the tags are in the picture, the surface is not.
  DetectedBody behind = true_pose(0);
  behind.probe_body.pose.translation = behind.probe_body.pose.translation * -1.0;
  finder_->answer(std::optional(behind));
  EXPECT_EQ(estimator_->estimate(shot.frames, descriptor_).code(), StatusCode::not_found);
  EXPECT_EQ(estimator_->gloss(), nullptr);
}

TEST_F(SpecularEstimatorTest, TheFirstDescriptorIsAFlaggedGuess) {
  const measure::Shot shot = sequence_->frame(0);
  const Status s = estimate(shot, 0);
  ASSERT_TRUE(s.ok()) << s.message();
  expect_flagged();
  EXPECT_EQ(descriptor_.flicker, Flicker::unknown);
  EXPECT_GE(descriptor_.coverage, 0.5F);
  EXPECT_LE(descriptor_.coverage, 1.0F);
  const FrameInfo& info = shot.frames[0].info;
  EXPECT_EQ(descriptor_.sequence, info.sequence);
  EXPECT_EQ(descriptor_.time.mid_exposure, info.mid_exposure);
  EXPECT_EQ(descriptor_.probe_id, 77U);
  EXPECT_EQ(descriptor_.calibration_id, calibration_identity(sequence_->rig()));
  EXPECT_EQ(descriptor_.units, estimator_->scale().units);
  EXPECT_EQ(descriptor_.T_probe_origin, sequence_->true_pose(0));
}

TEST_F(SpecularEstimatorTest, TheScaleIsAppliedOnce) {
  ASSERT_TRUE(estimate(sequence_->frame(0), 0).ok());
  const float relative = descriptor_.radiance.c[0].g;
  EXPECT_GT(relative, 0);
  make(small_options());
  estimator_->set_scale({Units::absolute, 100});
  ASSERT_TRUE(estimate(sequence_->frame(0), 0).ok());
  EXPECT_EQ(descriptor_.units, Units::absolute);
  EXPECT_NEAR(descriptor_.radiance.c[0].g / relative, 100, 1e-3);
}

TEST_F(SpecularEstimatorTest, AMattePlaneNeverShowsALight) {
  for (int k = 0; k < kFrames; k += 2) {
    const Status s = estimate(matte_frame(k), k);
    ASSERT_TRUE(s.ok()) << s.message();
    expect_flagged();
  }
  estimator_->finish();
  ASSERT_NE(estimator_->gloss(), nullptr);
  EXPECT_FALSE(estimator_->gloss()->glossy);
  ASSERT_TRUE(estimate(matte_frame(kFrames - 1), kFrames - 1).ok());
  expect_flagged();
}

TEST_F(SpecularEstimatorTest, AGlossyPlaneShowsTheLamps) {
  // Estimates of the environment take most of the test's time.
  SpecularOptions options = small_options();
  options.frames_between_estimates = 1000;
  make(options);
  for (int k = 0; k < kFrames; ++k) ASSERT_TRUE(estimate(sequence_->frame(k), k).ok());
  estimator_->finish();
  ASSERT_NE(estimator_->gloss(), nullptr);
  EXPECT_TRUE(estimator_->gloss()->glossy);
  ASSERT_TRUE(estimate(sequence_->frame(kFrames - 1), kFrames - 1).ok());
  EXPECT_EQ(descriptor_.T_probe_origin, sequence_->true_pose(kFrames - 1));
  ASSERT_FALSE(descriptor_.lights.empty());
  const Light& strongest =
      *std::ranges::max_element(descriptor_.lights, {}, [](const Light& l) { return l.irradiance.luminance(); });
  const Vec3f d = rotate(descriptor_.T_probe_origin.rotation.inverse(), strongest.direction);
  const reference::V3 world = reference::world_from_plane({double{d.x}, double{d.y}, double{d.z}});
  const reference::Panorama& environment = sequence_->environment();
  double peak = 0, angle = 180;
  for (int j = 0; j < environment.height / 2; ++j)
    for (int i = 0; i < environment.width; ++i)
      peak = std::max(peak, reference::luminance(reference::pixel(environment, i, j)));
  for (int j = 0; j < environment.height / 2; ++j)
    for (int i = 0; i < environment.width; ++i)
      // Lamps are 30 to 100 times as bright as the rest.
      if (reference::luminance(reference::pixel(environment, i, j)) > 0.2 * peak)
        angle = std::min(angle, reference::angle_deg(
                                    world, reference::pixel_direction(i, j, environment.width, environment.height)));
  // A lamp is a disc of 2 to 6 degrees; cells are 3 degrees wide.
  EXPECT_LT(angle, 3);
  EXPECT_GT(strongest.direction_covariance[0], 0);
}

// An estimate is that of the capture at its start, in steps after the next frames; descriptors have the one before.
TEST_F(SpecularEstimatorTest, AnEstimateIsDividedAmongFrames) {
  SpecularOptions options = small_options();
  options.frames_between_estimates = 10;
  options.light_operations = 3'000'000;
  make(options);
  specular::GlossEstimator whole;
  std::vector<int> frames;
  double last = 0;
  for (int k = 0; k < kFrames; ++k) {
    const bool estimating = estimator_->estimating();
    ASSERT_TRUE(estimate(sequence_->frame(k), k).ok());
    if (!estimating && estimator_->estimating()) {
      const specular::ReflectanceSeparation& separation = estimator_->capture().separation();
      whole.begin(separation.specular(), separation.diffuse(), {}, specular::RoughnessMode::track);
      whole.step(specular::WorkBudget::kUnlimited);
      frames.push_back(0);
    }
    if (estimating) ++frames.back();
    const specular::GlossEstimate* gloss = estimator_->gloss();
    if (estimating && !estimator_->estimating()) {
      ASSERT_NE(gloss, nullptr);
      EXPECT_EQ(gloss->environment.radiance, whole.last()->environment.radiance);
      last = gloss->misfit;
    }
    if (gloss != nullptr && gloss->glossy) {
      EXPECT_EQ(gloss->misfit, last) << "frame " << k;
    }
  }
  if (estimator_->estimating()) frames.pop_back();
  ASSERT_GE(frames.size(), 2U);
  EXPECT_GT(*std::ranges::min_element(frames), 5);
  // 45 iterations of 0.92 million operations, and the operator.
  EXPECT_LT(*std::ranges::max_element(frames), 40);
}

TEST_F(SpecularEstimatorTest, AnEstimateOfTheFormerLightIsAbandoned) {
  SpecularOptions options = small_options();
  options.capture.refine_pose = true;
  options.light_operations = 1;  // It would take hundreds of frames.
  make(options);
  bool started = false;
  for (int k = 0; k < kFrames; ++k) {
    measure::Shot shot = sequence_->frame(k);
    const bool estimating = estimator_->estimating();
    // The same pixels after twice the exposure: half of the radiance.
    if (started) shot.frames[0].info.exposure_s *= 2;
    started = started || estimating;
    ASSERT_TRUE(estimate(shot, k).ok());
    if (estimator_->capture().restarts() == 0) continue;
    EXPECT_TRUE(estimating);
    EXPECT_FALSE(estimator_->estimating());
    EXPECT_EQ(estimator_->gloss(), nullptr);
    return;
  }
  FAIL() << "the change of the light was not noticed";
}

TEST_F(SpecularEstimatorTest, AReplayGivesTheSameDescriptors) {
  SpecularOptions options = small_options();
  options.frames_between_estimates = 5;
  std::vector<Descriptor> first;
  for (int run = 0; run < 2; ++run) {
    make(options);
    for (int k = 0; k < 60; ++k) {
      ASSERT_TRUE(estimate(sequence_->frame(k), k).ok());
      if (run == 0) {
        first.push_back(descriptor_);
      } else {
        EXPECT_EQ(descriptor_.radiance.c, first[static_cast<std::size_t>(k)].radiance.c) << "frame " << k;
        EXPECT_EQ(descriptor_.lights.size(), first[static_cast<std::size_t>(k)].lights.size()) << "frame " << k;
      }
    }
    EXPECT_TRUE(estimator_->gloss() != nullptr && estimator_->gloss()->glossy);
  }
}

TEST_F(SpecularEstimatorTest, AnAmbiguousPoseIsUnsureAndNotCaptured) {
  ASSERT_TRUE(estimate(sequence_->frame(0), 0).ok());
  const std::size_t stored = estimator_->capture().light_field().bytes();
  DetectedBody ambiguous = true_pose(10);
  ambiguous.ambiguous = true;
  finder_->answer(std::optional(ambiguous));
  const measure::Shot shot = sequence_->frame(10);
  ASSERT_TRUE(estimator_->estimate(shot.frames, descriptor_).ok());
  EXPECT_TRUE(descriptor_.flags.has(Flag::unsure));
  EXPECT_EQ(estimator_->capture().light_field().bytes(), stored);
}

TEST_F(SpecularEstimatorTest, BlackAndSaturatedFramesAreFlagged) {
  for (const std::byte code : {std::byte{0}, std::byte{255}}) {
    make(small_options());
    for (int k = 0; k < 40; ++k) {
      const Status s = estimate(even_frame(k, code), k);
      if (s.ok())
        expect_flagged();
      else
        EXPECT_EQ(s.code(), StatusCode::not_found) << s.message();
    }
    estimator_->finish();
    if (estimate(even_frame(40, code), 40).ok()) expect_flagged();
  }
}

}  // namespace
}  // namespace lightwell
