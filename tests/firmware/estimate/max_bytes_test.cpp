// The limit of a descriptor's size (panorama.max_bytes): every message keeps it, with the bound holding and the least
// error that the size allows.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <lightwell/codec.hpp>

#include "scenes.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

constexpr std::array kLimits = {kMinMaxBytes, 97, 110, 128, 160, 192, 256, 400};

EstimatorConfig limited(int max_bytes, double epsilon = 0.01) {
  EstimatorConfig config;
  config.panorama.epsilon = epsilon;
  config.panorama.max_bytes = max_bytes;
  return config;
}

/// Encoded as late as a message can say.
std::size_t size_of(Descriptor d) {
  d.environment.reset();
  d.time.encoded_after.ns = std::numeric_limits<std::int64_t>::max();
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return bytes.ok() ? bytes->size() : 0;
}

/// The descriptor as a reader has it.
Descriptor received(const Descriptor& d) {
  Encoder encoder;
  return *decode_descriptor(*encoder.encode(d));
}

/// Walls of several colours and up to twelve lamps of any size and strength.
RadianceOf random_scene(std::mt19937_64& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  const auto direction = [&] { return normalized(Vec3d{unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5}); };
  struct Patch {
    Vec3d axis;
    double cos_edge;
    Radiance radiance;
  };
  std::vector<Patch> patches;
  const auto add = [&](double radius, float strength) {
    patches.push_back(
        {direction(),
         std::cos(radius),
         {strength * (0.2F + unit(random)), strength * (0.2F + unit(random)), strength * (0.2F + unit(random))}});
  };
  for (int k = 0; k < 6; ++k) add(0.3 + 0.7 * unit(random), 2);
  for (std::size_t lamps = random() % 13; lamps > 0; --lamps)
    add(0.03 + 0.3 * unit(random), std::pow(10.0F, 1 + 3 * unit(random)));
  return [patches](Vec3d d) {
    Radiance out{0.3F, 0.3F, 0.3F};
    for (const Patch& p : patches)
      if (dot(d, p.axis) > p.cos_edge) out.r += p.radiance.r, out.g += p.radiance.g, out.b += p.radiance.b;
    return out;
  };
}

TEST(MaxBytes, HoldsInRandomScenesAndMoreBytesGiveLessError) {
  std::mt19937_64 random(24);
  const RigParameters rig = rig_of("pair", 160, 120);
  std::array<double, kLimits.size()> errors{};
  for (int scene = 0; scene < 40; ++scene) {
    Picture picture = picture_of(rig, random_scene(random));
    picture.frame.info.sequence = random() >> (random() % 64);
    for (const double epsilon : {0.0, 0.01}) {
      // As exact as these pixels allow: the reference is the descriptor with all that was found.
      const Descriptor all = estimated(*estimator_of(rig, everything(6, 64)), picture);
      for (std::size_t k = 0; k < kLimits.size(); ++k) {
        const auto estimator = estimator_of(rig, limited(kLimits[k], epsilon));
        const Descriptor d = estimated(*estimator, picture);
        ASSERT_LE(size_of(d), static_cast<std::size_t>(kLimits[k])) << scene;
        const Descriptor sent = received(d);
        const double error = error_of(sent, [&](Vec3d n) { return irradiance_at(all, vec_cast<float>(n)); });
        EXPECT_LE(error, sent.bound.total) << scene << " " << kLimits[k];
        if (epsilon == 0) errors[k] += error / 40;
      }
    }
  }
  for (std::size_t k = 1; k < kLimits.size(); ++k) EXPECT_LT(errors[k], errors[k - 1] * 1.01) << kLimits[k];
  // Band 1 is always there; all lamps and four bands in 400 bytes.
  EXPECT_LT(errors.front(), 0.25);
  EXPECT_LT(errors.back(), 0.01);
}

TEST(MaxBytes, HoldsWithEveryFlagAndInExtremeScenes) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const RigParameters rig = rig_of("pair", 160, 120);
  std::mt19937_64 random(5);
  const auto seen = [&](Picture&& p, const char* what, auto&& check) {
    for (const int limit : kLimits) {
      for (const Setting setting : kSettings) {
        EstimatorConfig config = limited(limit);
        config.setting = setting;
        config.panorama.unseen = UnseenFill::mirror;
        const auto estimator = estimator_of(rig, config);
        p.frame.info.sequence = std::numeric_limits<std::uint64_t>::max();
        p.frame.info.delivered.ns = std::numeric_limits<std::int64_t>::max() / 2;
        for (int frame = 0; frame < 3; ++frame) {
          p.frame.info.mid_exposure.ns = frame * 33'000'000LL;
          const Descriptor d = estimated(*estimator, p);
          EXPECT_LE(size_of(d), static_cast<std::size_t>(limit)) << what << " " << to_string(setting);
          check(d);
        }
      }
    }
  };
  const auto any = [](const Descriptor&) {};
  seen(picture_of(rig, [](Vec3d) { return Radiance{}; }), "black",
       [](const Descriptor& d) { EXPECT_TRUE(d.flags.has(Flag::dark)); });
  for (const float scale : {1e-30F, 1e-12F, 1e12F, 1e25F})
    seen(picture_of(rig, [&](Vec3d p) { return lamp({0.4, 0.3, -0.8}, 0.07, 300)(p) * scale; }), "scaled", any);
  Picture bad = picture_of(rig, random_scene(random));
  for (std::size_t k = 0; k < 40; ++k) bad.pixels[0][random() % bad.pixels[0].size()] = k % 2 == 0 ? kInf : -kInf;
  Frame one_lens;
  one_lens.info = bad.frame.info;
  one_lens.add_view(bad.frame.views()[0]);
  bad.frame = std::move(one_lens);
  seen(std::move(bad), "infinite pixels, one lens missing", [](const Descriptor& d) {
    for (const Flag flag : {Flag::cleaned, Flag::clipped, Flag::unseen}) EXPECT_TRUE(d.flags.has(flag));
    EXPECT_TRUE(std::isinf(d.bound.total));
  });
  Picture hot = picture_of(rig, [](Vec3d) { return Radiance{1, 1, 1}; });
  for (std::size_t k = 0; k < 3; ++k) hot.pixels[0][3 * (60 * 160 + 80) + k] = 1e20F;
  seen(std::move(hot), "one hot pixel", any);
}

TEST(MaxBytes, ChangesNothingWhereTheMessageIsShorter) {
  std::mt19937_64 random(8);
  const RigParameters rig = rig_of("pair", 160, 120);
  for (int scene = 0; scene < 10; ++scene) {
    const Picture picture = picture_of(rig, random_scene(random));
    const Descriptor free = estimated(*estimator_of(rig, limited(0)), picture);
    // What is counted may exceed what is sent: a byte of truncation, quantization and the radiance's exponent, one of
    // each light's exponent.
    const int size =
        std::max(kMinMaxBytes, static_cast<int>(size_of(free)) + 3 + 3 * static_cast<int>(free.lights.size()));
    EXPECT_EQ(estimated(*estimator_of(rig, limited(size)), picture), free) << size;
  }
}

TEST(MaxBytes, ABoundThatDoesNotFitKeepsItsTotal) {
  const RigParameters rig = rig_of("single", 160, 120);
  Picture picture = picture_of(rig, lamp({0, 0, -1}, 0.1, 100));
  picture.pixels[0][3 * (60 * 160 + 80)] = std::numeric_limits<float>::infinity();
  PanoramaOptions options;
  options.probe_id = 1;
  options.config = limited(128);
  const auto estimator = make_panorama_estimator(rig, options);
  ASSERT_TRUE(estimator.ok());
  const auto descriptor_of = [&](std::uint64_t sequence, std::int64_t delivered_ns) {
    picture.frame.info.sequence = sequence;
    picture.frame.info.mid_exposure.ns = 1;
    picture.frame.info.delivered.ns = delivered_ns;
    const Descriptor d = estimated(**estimator, picture);
    EXPECT_LE(size_of(d), sequence == 100 ? 128U : std::size_t{kMinMaxBytes});
    EXPECT_TRUE(d.flags.has(Flag::unseen) && std::isinf(d.bound.total));
    return d;
  };
  EXPECT_GT(descriptor_of(100, 1).bound.truncation, 0);
  ASSERT_TRUE((*estimator)->configure(limited(kMinMaxBytes)).ok());
  // A number of ten bytes and an hour until delivery leave no room for the parts.
  const Descriptor d = descriptor_of(std::numeric_limits<std::uint64_t>::max(), 3'600'000'000'000);
  EXPECT_EQ(d.bound, ErrorBound{.total = d.bound.total});
}

}  // namespace
}  // namespace lightwell
