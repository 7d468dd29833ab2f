// Whole maps and changes: lost messages must not cause a wrong map.
#include "estimate/common/environment_updates.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

namespace lightwell::estimate {
namespace {

constexpr std::int64_t kMs = 1'000'000;
const std::vector<EnvironmentLevel> kLevels = {{16, 0}, {8, 0.5F}, {8, 1}};

std::vector<Rgbx> flat(float radiance) {
  return std::vector<Rgbx>(texel_count(kLevels), {{radiance, radiance, radiance, 0}});
}

/// Sends one map every 100 ms.
struct Sender {
  EnvironmentUpdates updates{kLevels, {.rate_hz = 10, .key_interval_s = 1}};
  std::optional<EnvironmentMap> out;
  std::int64_t time_ms = 0;

  const EnvironmentMap& send(const std::vector<Rgbx>& texels, double factor = 1) {
    updates.update(texels, {}, factor, {time_ms * kMs}, out);
    time_ms += 100;
    EXPECT_TRUE(out.has_value());
    return *out;
  }
};

TEST(EnvironmentUpdates, StartsWithAWholeMapAndOmitsUnchangedTexels) {
  Sender sender;
  std::uint32_t key = 0;
  for (int k = 0; k < 30; ++k) {
    const EnvironmentMap& map = sender.send(flat(3));
    EXPECT_EQ(map.whole(), k % 10 == 0) << k;
    if (k == 0) key = map.key;
    EXPECT_EQ(map.key, key) << "an unchanged map keeps its key";
    EXPECT_TRUE(map.whole() || (map.texels.empty() && map.runs.empty()));
  }
}

TEST(EnvironmentUpdates, SendsTexelsThatDifferByMoreThanAStep) {
  Sender sender;
  auto texels = flat(100);
  const EnvironmentMap key = sender.send(texels);
  texels[5].v[1] = 100.7F;  // Below one step, including half a step of the encoding.
  texels[40].v[2] = 98;     // Two steps.
  texels[41].v[0] = 102;
  texels[300].v[0] = 102;  // In the second level.
  const EnvironmentMap changes = sender.send(texels);
  EXPECT_FALSE(changes.whole());
  EXPECT_EQ(changes.key, key.key);
  EXPECT_EQ(changes.runs, (std::vector<std::uint32_t>{40, 2, 258, 1}));
  EnvironmentMap applied;
  ASSERT_TRUE(apply_changes(key, changes, applied));
  EXPECT_NEAR(texel_radiance(applied.texels[41], applied.exponent).r, 102, 0.2);
  // Changes refer to the whole map, not to earlier changes: after undoing them there are none.
  const EnvironmentMap undone = sender.send(flat(100));
  EXPECT_TRUE(!undone.whole() && undone.runs.empty());
}

TEST(EnvironmentUpdates, AreWholeWhereChangesCostAsMuch) {
  Sender sender;
  (void)sender.send(flat(1));
  EXPECT_TRUE(sender.send(flat(2)).whole());
}

TEST(EnvironmentUpdates, AreWholeWhereRadianceExceedsTheExponent) {
  Sender sender;
  auto texels = flat(1);
  (void)sender.send(texels);
  texels[3].v[0] = 200;
  EXPECT_FALSE(sender.send(texels).whole());
  texels[3].v[0] = 2000;
  const EnvironmentMap& map = sender.send(texels);
  EXPECT_TRUE(map.whole());
  EXPECT_NEAR(texel_radiance(map.texels[3], map.exponent).r, 2000, 4);
}

TEST(EnvironmentUpdates, SendsTheTexelsInWhichLightsAre) {
  EnvironmentUpdates updates(kLevels, {.rate_hz = 10, .key_interval_s = 1});
  std::optional<EnvironmentMap> out;
  const std::vector<Rgbx> texels = flat(1);
  std::vector<Rgbx> first(texels.begin(), texels.begin() + 256);
  for (const std::size_t k : {40U, 41U, 255U}) first[k].v = {30'000, 3, 1, 0};
  const std::vector<std::uint32_t> tracks = {4, 9};
  std::optional<EnvironmentMap> key;
  for (int n = 0; n < 3; ++n) {
    // The third map has no lights.
    const EnvironmentUpdates::FirstLevel lights =
        n < 2 ? EnvironmentUpdates::FirstLevel{tracks, first} : EnvironmentUpdates::FirstLevel{};
    updates.update(texels, lights, 1, {n * 100 * kMs}, out);
    ASSERT_TRUE(out);
    EXPECT_TRUE(environment_problem(*out).ok()) << environment_problem(*out).message();
    if (n == 0) key = out;
    EXPECT_EQ(out->whole(), n == 0);
    EXPECT_EQ(out->light_tracks, n < 2 ? tracks : std::vector<std::uint32_t>{});
    EXPECT_EQ(out->light_texels.size(), n < 2 ? 3U : 0U);
    EnvironmentMap applied;
    if (n == 1) {
      ASSERT_TRUE(apply_changes(*key, *out, applied));
    } else {
      applied = *out;
    }
    if (n == 2) continue;
    const EnvironmentMap shown = first_level_with_lights(applied);
    // Far brighter than the map: the exponent holds both.
    EXPECT_NEAR(texel_radiance(shown.texels[255], shown.exponent).r, 30'000, 60);
    EXPECT_NEAR(texel_radiance(shown.texels[254], shown.exponent).r, 1, 0.01);
    EXPECT_NEAR(texel_radiance(applied.texels[255], applied.exponent).r, 1, 0.01);
  }
}

TEST(EnvironmentUpdates, KeepsTheMeanRateAndTheKeyInterval) {
  for (const double fps : {30.0, 33.3, 7.0, 4.0}) {
    EnvironmentUpdates updates(kLevels, {.rate_hz = 5, .key_interval_s = 1});
    std::optional<EnvironmentMap> out;
    int maps = 0;
    double last_key = 0;
    for (double t = 0; t < 60; t += 1 / fps) {
      const ProbeTime time{static_cast<std::int64_t>(1e9 * t)};
      const bool due = updates.due(time);
      updates.update(flat(1), {}, 1, time, out);
      EXPECT_EQ(due, out.has_value());
      if (!out) continue;
      ++maps;
      if (out->whole()) {
        EXPECT_LE(t - last_key, 1.2 + 1 / fps + 1e-6) << fps;
        last_key = t;
      }
    }
    EXPECT_NEAR(maps, 60 * std::min(5.0, fps), 0.03 * 300) << fps;
  }
}

TEST(EnvironmentUpdates, ContinuesAfterAPauseAndAClockRestart) {
  EnvironmentUpdates updates(kLevels, {.rate_hz = 5, .key_interval_s = 1});
  std::optional<EnvironmentMap> out;
  updates.update(flat(1), {}, 1, {100'000 * kMs}, out);
  updates.update(flat(1), {}, 1, {160'000 * kMs}, out);
  EXPECT_TRUE(out && out->whole());
  updates.update(flat(1), {}, 1, {160'100 * kMs}, out);
  EXPECT_FALSE(out) << "no burst after a pause";
  updates.update(flat(1), {}, 1, {10 * kMs}, out);
  EXPECT_TRUE(out && out->whole());
}

TEST(EnvironmentUpdates, EncodesEveryMagnitudeAndRefusesInvalidFactors) {
  Encoder encoder;
  Descriptor d;
  for (const float radiance : {0.0F, 1e-38F, 1e-8F, 1.0F, 1e8F, 1e30F, 3e38F})
    for (const double factor : {1e-8, 1.0, 1e8}) {
      EnvironmentUpdates updates(kLevels, {});
      updates.update(flat(radiance), {}, factor, {0}, d.environment);
      ASSERT_TRUE(d.environment);
      ASSERT_TRUE(encoder.encode(d).ok()) << encoder.encode(d).status().message();
      const double wanted = std::min(factor * radiance, 65408 * std::ldexp(1.0, kMaxEnvironmentExponent));
      const double got = environment_radiance(*d.environment, {1, 0, 0}, 0).r;
      // Radiance below 2^-150 is encoded as 0.
      EXPECT_NEAR(got, wanted, wanted / 256 + 1e-44) << radiance << " " << factor;
    }
  EnvironmentUpdates updates(kLevels, {});
  for (const double factor : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    updates.update(flat(1), {}, factor, {0}, d.environment);
    EXPECT_FALSE(d.environment);
  }
}

/// A reader that receives only some of the messages.
struct Reader {
  EnvironmentMap key, current;
  int shown = -1;  ///< Number of the message that `current` corresponds to.

  void read(const EnvironmentMap& map, int number) {
    if (map.whole()) {
      key = current = map;
      shown = number;
    } else if (apply_changes(key, map, current)) {
      shown = number;
    }
  }
};

TEST(EnvironmentUpdates, LostMessagesNeverCauseAWrongMap) {
  std::mt19937 random(7);
  for (int run = 0; run < 300; ++run) {
    Sender sender;
    if (run % 3 == 0) sender.updates.restart();
    auto texels = flat(10);
    std::vector<std::vector<Rgbx>> truth;
    Reader reader;
    const auto loss = random() % 10;
    bool key_came = false;
    for (int n = 0; n < 45; ++n) {
      // Some texels change, some return to their first value, and sometimes the probe restarts.
      for (auto k = random() % 20; k > 0; --k)
        texels[random() % texels.size()].v[random() % 3] = static_cast<float>(random() % 30);
      if (random() % 4 == 0) texels = flat(10);
      if (random() % 20 == 0) {
        const std::int64_t time_ms = sender.time_ms;
        sender = Sender{};
        sender.time_ms = random() % 2 == 0 ? 0 : time_ms;
      }
      truth.push_back(texels);
      const EnvironmentMap& map = sender.send(texels);
      if (random() % 10 < loss) continue;
      key_came = key_came || map.whole();
      reader.read(map, n);
      EXPECT_EQ(reader.shown >= 0, key_came);
      EXPECT_EQ(reader.shown == n, map.whole() || map.key == reader.key.key)
          << "every decodable message must be applied";
      if (reader.shown < 0) continue;
      const auto& wanted = truth[static_cast<std::size_t>(reader.shown)];
      std::size_t at = 0;
      for (const EnvironmentLevel& level : kLevels) {
        const std::size_t count = texel_count(std::span(&level, 1));
        double mean = 0;
        for (std::size_t k = at; k < at + count; ++k)
          mean += std::max({wanted[k].v[0], wanted[k].v[1], wanted[k].v[2]}) / static_cast<double>(count);
        for (const std::size_t end = at + count; at < end; ++at) {
          const Radiance l = texel_radiance(reader.current.texels[at], reader.current.exponent);
          const float most = std::max({wanted[at].v[0], wanted[at].v[1], wanted[at].v[2]});
          // Tolerance: one step of 1 %, relative to at least a tenth of the mean.
          const double step = 0.01 * std::max<double>(most, 0.1 * mean) + 1e-5;
          for (int k = 0; k < 3; ++k) ASSERT_NEAR(l[k], wanted[at].v[static_cast<std::size_t>(k)], step);
        }
      }
    }
  }
}

}  // namespace
}  // namespace lightwell::estimate
