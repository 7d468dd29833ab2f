// The result of "An estimator" in CONTRIBUTING.md. Steps 1 and 2 extend an enum and messages, which is impossible here;
// step 3 is constant_estimator, and the target of this test, with the estimator in it; step 6 is the comment of
// make_constant_estimator().
#include "structure/skeletons/estimator/constant_estimator.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>

#include "app/component_tables.hpp"

namespace lightwell {
namespace {

// Step 4: the row of estimator_table(), and its function.
Result<std::unique_ptr<Estimator>> make_constant(const Config& config, const RigParameters& rig,
                                                 const std::optional<UncertainPose>& /*mounting*/) {
  return make_constant_estimator(rig, {config.estimator, fnv1a_32(config.probe_name)});
}
constexpr EstimatorEntry kRow{EstimatorKind::panorama, "nothing", &make_constant};

// Step 5: from a frame to an encoded descriptor and back.
TEST(ConstantEstimator, ItsDescriptorEncodes) {
  constexpr int kWidth = 32, kHeight = 16;
  RigParameters rig;
  LensParameters& lens = rig.lenses.emplace_back();
  lens.width = kWidth;
  lens.height = kHeight;
  lens.model = EquirectangularParameters{};
  lens.max_angle_rad = std::numbers::pi;
  lens.pose_cv.rotation = upright_lens_cv();
  const Result<std::unique_ptr<Estimator>> estimator = kRow.make(Config{}, rig, {});
  ASSERT_TRUE(estimator.ok()) << estimator.status().message();

  const std::vector<std::byte> pixels(picture_bytes(PixelFormat::rgb8, 3 * kWidth, kHeight));
  Frame frame;
  frame.info.exposure_s = 0.01;
  frame.add_view({0, PixelFormat::rgb8, kWidth, kHeight, 3 * kWidth, pixels});
  Descriptor descriptor;
  const Status estimated = (*estimator)->estimate({&frame, 1}, descriptor);
  ASSERT_TRUE(estimated.ok()) << estimated.message();

  Encoder encoder;
  const Result<std::span<const std::byte>> bytes = encoder.encode(descriptor);
  ASSERT_TRUE(bytes.ok()) << bytes.status().message();
  const Result<Descriptor> decoded = decode_descriptor(*bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  EXPECT_NEAR(irradiance_at(*decoded, {0, 1, 0}).g, std::numbers::pi, 1e-3) << "the irradiance of radiance 1";
  EXPECT_TRUE(std::isinf(decoded->bound.total));
}

}  // namespace
}  // namespace lightwell
