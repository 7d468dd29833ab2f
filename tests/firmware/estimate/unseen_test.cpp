// Filling of directions that no pixel sees; filled values must not enter the time average.
#include <cmath>
#include <numbers>

#include "scenes.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

EstimatorConfig filled_by(UnseenFill fill) {
  EstimatorConfig config = everything();
  config.panorama.unseen = fill;
  config.panorama.smoothing = Smoothing::none;
  return config;
}

Vec3d axis_of(const RigParameters& rig) {
  Vec3d sum;
  const RigTable table = *make_rig_table(rig);
  const LensTable& lens = table.lenses[0];
  for (std::size_t i = 0; i < lens.direction.size(); ++i)
    sum += vec_cast<double>(lens.direction[i]) * static_cast<double>(lens.solid_angle[i]);
  return normalized(sum);
}

Descriptor at(Estimator& estimator, Picture& picture, int frame) {
  picture.frame.info.mid_exposure.ns = 1'000'000'000 + frame * 33'333'333LL;
  return estimated(estimator, picture);
}

/// Removes the view of the second camera.
void lose_second_lens(Picture& picture) {
  const View first = picture.frame.views()[0];
  const FrameInfo info = picture.frame.info;
  picture.frame = Frame();
  picture.frame.info = info;
  picture.frame.add_view(first);
}

double irradiance_luminance(const Descriptor& d, Vec3d normal) {
  return irradiance_at(d, vec_cast<float>(normal)).luminance();
}

TEST(Unseen, WithoutFillingIsDark) {
  const RigParameters rig = rig_of("single", 240, 180);
  const Descriptor d = estimated(
      rig,
      [](Vec3d) {
        return Radiance{1, 1, 1};
      },
      filled_by(UnseenFill::none));
  const Vec3d axis = axis_of(rig);
  EXPECT_TRUE(d.flags.has(Flag::unseen));
  EXPECT_FALSE(d.flags.has(Flag::filled));
  // A cap of 95 degrees contains the hemisphere of its axis, and a rim of 5 degrees of the other: pi sin² 5 = 0.024.
  EXPECT_NEAR(irradiance_luminance(d, axis), std::numbers::pi, 0.1);
  EXPECT_NEAR(irradiance_luminance(d, -axis), 0.024, 0.1);
}

TEST(Unseen, MirrorReproducesASymmetricRoom) {
  const RigParameters rig = rig_of("single", 240, 180);
  const Vec3d axis = axis_of(rig);
  const auto room = [&](Vec3d d) {
    const double z = dot(d, axis);
    const auto l = static_cast<float>(1 + z * z);
    return Radiance{l, l, l};
  };
  const Descriptor d = estimated(rig, room, filled_by(UnseenFill::mirror));
  EXPECT_TRUE(d.flags.has(Flag::unseen) && d.flags.has(Flag::filled));
  EXPECT_TRUE(std::isinf(d.bound.total)) << "unobserved directions have no bound";
  // Irradiance of z² at the pole: 2 pi times the integral of c³ from 0 to 1, pi / 2. The observed cap ends at 95
  // degrees, the mirror plane is at 90: directions differ by up to 10 degrees.
  EXPECT_NEAR(irradiance_luminance(d, axis), 1.5 * std::numbers::pi, 0.05 * 1.5 * std::numbers::pi);
  EXPECT_NEAR(irradiance_luminance(d, -axis), irradiance_luminance(d, axis), 0.05 * irradiance_luminance(d, axis));
}

TEST(Unseen, AverageOfObservedFramesPersists) {
  const RigParameters rig = rig_of("pair", 160, 120);
  const auto room = [](Vec3d d) {
    const auto l = static_cast<float>(1.2 + d.z + 0.3 * d.x * d.y);
    return Radiance{l, 0.5F * l, l};
  };
  const auto estimator = estimator_of(rig, filled_by(UnseenFill::average));
  Picture picture = picture_of(rig, room);
  Descriptor whole;
  int frame = 0;
  for (; frame < 60; ++frame) whole = at(*estimator, picture, frame);
  EXPECT_FALSE(whole.flags.has(Flag::unseen));
  lose_second_lens(picture);
  for (int frames_without = 0; frames_without < 600; ++frames_without, ++frame) {
    const Descriptor d = at(*estimator, picture, frame);
    ASSERT_TRUE(d.flags.has(Flag::unseen) && d.flags.has(Flag::filled)) << frames_without;
    if (frames_without % 100 != 0 && frames_without != 599) continue;
    for (const Vec3d n : {Vec3d{0, 0, 1}, Vec3d{0, 0, -1}, Vec3d{0, 1, 0}})
      // Tolerance: with one lens missing, pixels of the overlap still count only in part.
      EXPECT_NEAR(irradiance_luminance(d, n), irradiance_luminance(whole, n), 0.02 * irradiance_luminance(whole, n))
          << "frame " << frames_without << " without the lens";
  }
}

TEST(Unseen, AverageWithoutObservationsIsDark) {
  const RigParameters rig = rig_of("pair", 160, 120);
  const auto estimator = estimator_of(rig, filled_by(UnseenFill::average));
  Picture picture = picture_of(rig, [](Vec3d) { return Radiance{1, 1, 1}; });
  lose_second_lens(picture);
  const Descriptor d = at(*estimator, picture, 0);
  EXPECT_TRUE(d.flags.has(Flag::unseen));
  EXPECT_FALSE(d.flags.has(Flag::filled)) << "no earlier observation exists";
}

TEST(Unseen, ReturningLensIsObservedAgain) {
  const RigParameters rig = rig_of("pair", 160, 120);
  const auto estimator = estimator_of(rig, filled_by(UnseenFill::average));
  Picture dim = picture_of(rig, [](Vec3d) { return Radiance{1, 1, 1}; });
  Picture bright = picture_of(rig, [](Vec3d) { return Radiance{5, 5, 5}; });
  for (int frame = 0; frame < 30; ++frame) (void)at(*estimator, dim, frame);
  lose_second_lens(dim);
  (void)at(*estimator, dim, 30);
  const Descriptor d = at(*estimator, bright, 31);
  EXPECT_FALSE(d.flags.any());
  for (const Vec3d n : {Vec3d{0, 0, 1}, Vec3d{0, 0, -1}})
    EXPECT_NEAR(irradiance_luminance(d, n), 5 * std::numbers::pi, 1e-3);
}

}  // namespace
}  // namespace lightwell
