// Environment maps in the SDK: whole maps, changes, lost messages, age, rotation.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/lobes.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/query.hpp>

#include "core/descriptor_receiver.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// A map with radiance 2 + x at the sharp level, constant at the rough level.
EnvironmentMap whole_map(float rough = 5) {
  EnvironmentMap map;
  map.levels = {{32, 0}, {8, 1}};
  map.key_interval_ms = 1000;
  for (const EnvironmentLevel level : map.levels)
    for (int j = 0; j < level.edge; ++j)
      for (int i = 0; i < level.edge; ++i) {
        const float v = level.roughness > 0 ? rough : 2 + texel_direction(level.edge, i, j).x;
        map.texels.push_back(rgb9e5_encode(v, v, v));
      }
  map.key = environment_key(map);
  return map;
}

/// All texels of the rough level become `rough`.
EnvironmentMap changes(const EnvironmentMap& whole, float rough) {
  EnvironmentMap map;
  map.key = whole.key;
  map.runs = {32 * 32, 64};
  map.texels.assign(64, rgb9e5_encode(rough, rough, rough));
  return map;
}

Descriptor with_map(std::optional<EnvironmentMap> map, std::uint64_t sequence, std::int64_t time_ms) {
  Descriptor d = test::constant_scene({9, 9, 9});
  d.environment = std::move(map);
  d.sequence = sequence;
  d.time.mid_exposure.ns = time_ms * kMs;
  return d;
}

float rough_of(const std::shared_ptr<const EnvironmentSnapshot>& kept) {
  return kept ? environment_radiance(kept->map, {0, 1, 0}, 1).r : 0;
}

TEST(EnvironmentAssembler, KeepsTheNewestMapThroughMessagesWithoutMap) {
  EnvironmentAssembler assembler;
  const Descriptor none = with_map({}, 1, 0);
  EXPECT_TRUE(assembler.take(none));
  EXPECT_EQ(assembler.map_for(none), nullptr);
  EXPECT_TRUE(assembler.take(with_map(whole_map(), 2, 100)));
  EXPECT_EQ(rough_of(assembler.map_for(with_map({}, 3, 133))), 5);
  EXPECT_TRUE(assembler.take(with_map(changes(whole_map(), 6), 4, 200)));
  const auto changed = assembler.map_for(with_map({}, 5, 233));
  EXPECT_EQ(rough_of(changed), 6);
  EXPECT_EQ(changed->sequence, 4U);
  // Changes are to the whole map, not to each other.
  EnvironmentMap undone;
  undone.key = whole_map().key;
  EXPECT_TRUE(assembler.take(with_map(undone, 6, 300)));
  EXPECT_EQ(rough_of(assembler.map_for(with_map({}, 7, 333))), 5);
}

TEST(EnvironmentAssembler, ChangesWithoutTheirWholeMapAreRejected) {
  EnvironmentAssembler assembler;
  const EnvironmentMap other = whole_map(7);
  EXPECT_FALSE(assembler.take(with_map(changes(other, 6), 1, 0)));
  EXPECT_EQ(assembler.map_for(with_map({}, 1, 0)), nullptr);
  EXPECT_TRUE(assembler.take(with_map(whole_map(), 2, 100)));
  EXPECT_FALSE(assembler.take(with_map(changes(other, 6), 3, 200)));
  EXPECT_EQ(rough_of(assembler.map_for(with_map({}, 3, 200))), 5) << "the last one stays";
  EXPECT_TRUE(assembler.take(with_map(other, 4, 300)));
  EXPECT_EQ(rough_of(assembler.map_for(with_map({}, 4, 300))), 7);
}

TEST(EnvironmentAssembler, MapOfAnotherProbeOrTooOldIsNotUsed) {
  EnvironmentAssembler assembler;
  (void)assembler.take(with_map(whole_map(), 1, 10'000));
  EXPECT_NE(assembler.map_for(with_map({}, 2, 13'000)), nullptr);
  EXPECT_EQ(assembler.map_for(with_map({}, 2, 13'001)), nullptr) << "three intervals";
  EXPECT_EQ(assembler.map_for(with_map({}, 2, 9'999)), nullptr) << "the clock was reset";
  const auto other = [&](auto&& change) {
    Descriptor d = with_map({}, 2, 10'100);
    change(d);
    return assembler.map_for(d);
  };
  EXPECT_EQ(other([](Descriptor& d) { d.units = Units::relative; }), nullptr);
  EXPECT_EQ(other([](Descriptor& d) { d.probe_id = 99; }), nullptr);
  EXPECT_EQ(other([](Descriptor& d) { d.calibration_id = 99; }), nullptr);
}

TEST(EnvironmentAssembler, AnyPatternOfLossNeverGivesAWrongMap) {
  std::mt19937 random(11);
  for (int run = 0; run < 200; ++run) {
    EnvironmentAssembler assembler;
    EnvironmentMap key;
    std::vector<float> truth;
    const auto loss = random() % 10;
    for (int n = 0; n < 40; ++n) {
      const auto rough = static_cast<float>(1 + random() % 200);
      const bool whole = n % 8 == 0;
      if (whole) key = whole_map(rough);
      truth.push_back(rough);
      const Descriptor d = with_map(whole ? key : changes(key, rough), static_cast<std::uint64_t>(n), 50 * n);
      if (random() % 10 < loss) continue;
      (void)assembler.take(d);
      if (const auto kept = assembler.map_for(d)) {
        // 200 has eight bits, and nine are there.
        ASSERT_EQ(rough_of(kept), truth[kept->sequence]);
      }
    }
  }
}

TEST(LightingEnvironment, RadianceComesFromTheMapAndTheLights) {
  Descriptor d = with_map(whole_map(), 1, 0);
  d.lights = {test::light({0, 1, 0}, {3, 2, 1}, 0.1F)};
  const Lighting lighting = Lighting::of(d);
  for (const Vec3f v : test::directions()) {
    const Vec3f unit = normalized(v);
    const Answer<Radiance> mirror = lighting.radiance(v, 0);
    // 32 texels an edge, as environment_test.cpp has it.
    EXPECT_NEAR(mirror.value.r, 2 + unit.x, 0.04);
    EXPECT_EQ(mirror.lights, LightsIncluded::no);
    for (const float r : {0.3F, 0.5F, 1.0F}) {
      const float lights_part = lights_radiance(d.lights, v, GgxLobe(static_cast<double>(r))).r;
      const float map = (1 - r) * mirror.value.r + r * 5;
      EXPECT_NEAR(lighting.radiance(v, r).value.r, map + lights_part, 1e-4 * (map + lights_part));
      EXPECT_EQ(lighting.radiance(v, r).lights, LightsIncluded::yes);
    }
  }
  // Irradiance comes from the harmonics, not from the map.
  EXPECT_NEAR(lighting.irradiance({0, -1, 0}).value.r, 9 * 3.14159265, 1e-3);
}

/// whole_map() in which texels show the light with the track 5: a square window of radiance 50 around +Z.
EnvironmentMap map_with_window() {
  EnvironmentMap map = whole_map();
  map.light_tracks = {5};
  std::uint32_t same = 0;
  for (int j = 0; j < 32; ++j)
    for (int i = 0; i < 32; ++i) {
      const Vec3f d = texel_direction(32, i, j);
      if (d.z < 0.8F) {
        ++same;
        continue;
      }
      map.light_runs.insert(map.light_runs.end(), {same, 1});
      same = 0;
      map.light_texels.push_back(rgb9e5_encode(50, 50, 50));
    }
  // Neighbours are one run.
  for (std::size_t k = 2; k < map.light_runs.size();)
    if (map.light_runs[k] == 0) {
      map.light_runs[k - 1] += map.light_runs[k + 1];
      map.light_runs.erase(map.light_runs.begin() + static_cast<std::ptrdiff_t>(k),
                           map.light_runs.begin() + static_cast<std::ptrdiff_t>(k) + 2);
    } else {
      k += 2;
    }
  return map;
}

Descriptor window_and_lamp() {
  Descriptor d = with_map(map_with_window(), 1, 0);
  d.lights = {test::light({0, 0, 1}, {60, 60, 60}, 0.6F), test::light({0, 1, 0}, {3, 2, 1}, 0.1F)};
  d.lights[0].track = 5;
  d.lights[1].track = 6;
  return d;
}

TEST(LightingEnvironment, AMirrorShowsAWindowAsTexelsAndALampAsACap) {
  const Lighting lighting = Lighting::of(window_and_lamp());
  const auto view = lighting.environment();
  ASSERT_TRUE(view);
  EXPECT_NEAR(environment_radiance(view->mirror, {0, 0, 1}, 0).r, 50, 0.1);
  EXPECT_NEAR(environment_radiance(view->map, {0, 0, 1}, 0).r, 2, 0.1);
  EXPECT_NEAR(environment_radiance(view->mirror, {0, 1, 0}, 0).r, 2, 0.1);
  EXPECT_TRUE(view->shown_in_mirror(lighting.lights()[0]));
  EXPECT_FALSE(view->shown_in_mirror(lighting.lights()[1]));
  // radiance() leaves all lights out at roughness 0.
  EXPECT_NEAR(lighting.radiance({0, 0, 1}, 0).value.r, 2, 0.1);
}

TEST(LightingEnvironment, AWindowTurnsFromTexelsToACapWithRoughness) {
  const Descriptor d = window_and_lamp();
  const Lighting lighting = Lighting::of(d);
  for (const Vec3f v : test::directions())
    for (const float r : {0.05F, 0.3F, 0.7F, 1.0F}) {
      const GgxLobe lobe(static_cast<double>(r));
      const Vec3f unit = normalized(v);
      const float texels = environment_radiance(lighting.environment()->mirror, unit, 0).r;
      const float window = lights_radiance(std::span(d.lights).first(1), v, lobe).r,
                  lamp = lights_radiance(std::span(d.lights).last(1), v, lobe).r;
      const float expected = (1 - r) * texels + r * (5 + window) + lamp;
      EXPECT_NEAR(lighting.radiance(v, r).value.r, expected, 1e-4 * expected) << r;
    }
}

TEST(LightingEnvironment, AWindowThatBecameDarkLeavesMirrorsAtOnce) {
  core::EnvironmentAssembler assembler;
  ASSERT_TRUE(assembler.take(window_and_lamp()));
  Descriptor later = with_map({}, 2, 33);
  later.lights = {window_and_lamp().lights[1]};
  core::Sample sample = sample_of(later);
  sample.environment = assembler.map_for(later);
  const Lighting lighting(std::make_shared<const core::Sample>(std::move(sample)), Validity::valid, {}, {});
  const auto view = lighting.environment();
  ASSERT_TRUE(view);
  EXPECT_EQ(&view->mirror, &view->map);
  EXPECT_NEAR(environment_radiance(view->mirror, {0, 0, 1}, 0).r, 2, 0.1);
}

TEST(EnvironmentAssembler, LightsInTexelsBelongToOneMessage) {
  EnvironmentAssembler assembler;
  ASSERT_TRUE(assembler.take(window_and_lamp()));
  ASSERT_TRUE(assembler.take(with_map(changes(whole_map(), 6), 2, 100)));
  const auto kept = assembler.map_for(with_map({}, 3, 133));
  ASSERT_TRUE(kept);
  EXPECT_TRUE(kept->map.light_tracks.empty() && !kept->mirror.whole());
  EnvironmentMap again = changes(whole_map(), 7);
  const EnvironmentMap window = map_with_window();
  again.light_tracks = {8};
  again.light_runs = window.light_runs;
  again.light_texels = window.light_texels;
  ASSERT_TRUE(assembler.take(with_map(again, 4, 200)));
  EXPECT_NEAR(environment_radiance(assembler.map_for(with_map({}, 5, 233))->mirror, {0, 0, 1}, 0).r, 50, 0.1);
  // Of a larger map: they exceed the first level of this one.
  again.light_runs[0] += 32 * 32;
  EXPECT_FALSE(assembler.take(with_map(again, 6, 300)));
}

TEST(LightingEnvironment, WithoutAMapRadianceComesFromTheHarmonics) {
  EXPECT_FALSE(Lighting::of(with_map({}, 1, 0)).environment());
  EXPECT_NEAR(Lighting::of(with_map({}, 1, 0)).radiance({1, 0, 0}, 0.4F).value.r, 9, 1e-4);
  const Lighting changes_alone = Lighting::of(with_map(changes(whole_map(), 6), 1, 0));
  EXPECT_FALSE(changes_alone.environment());
  EXPECT_NEAR(changes_alone.radiance({1, 0, 0}, 0.4F).value.r, 9, 1e-4);
  EXPECT_FALSE(Lighting().environment());
}

TEST(LightingEnvironment, RotatesWithTheLighting) {
  const Lighting lighting = Lighting::of(with_map(whole_map(), 1, 0));
  const Quat q = Quat::about({0, 1, 0}, 0.7), p = Quat::about(normalized(Vec3d{1, 2, 3}), -1.9);
  const Lighting turned = lighting.rotated(q).rotated(p);
  for (const Vec3f v : test::directions())
    EXPECT_NEAR(turned.radiance(rotate(p * q, v), 0).value.r, lighting.radiance(v, 0).value.r, 1e-5);
  const auto view = turned.environment();
  ASSERT_TRUE(view);
  const Vec3f x = rotate(view->rotation, Vec3f{1, 0, 0}), wanted = rotate(p * q, Vec3f{1, 0, 0});
  EXPECT_NEAR(length(x - wanted), 0, 1e-6);
}

class EnvironmentReceiver : public ::testing::Test {
 protected:
  void take(const Descriptor& d) {
    const std::string bytes = test::encoded(d);
    ASSERT_FALSE(bytes.empty());
    receiver_.receive(test::as_bytes(bytes), {0}, [](const CaptureTime& t) {
      return MappedTime{{t.mid_exposure.ns}, {}};
    });
  }
  DescriptorReceiver receiver_{ProbeOptions{}};
};

TEST_F(EnvironmentReceiver, CountsMapsAndMapsWithoutKey) {
  take(with_map({}, 1, 0));
  take(with_map(changes(whole_map(), 6), 2, 30));
  EXPECT_FALSE(receiver_.latest({30 * kMs}).environment());
  take(with_map(whole_map(), 3, 60));
  take(with_map(changes(whole_map(), 6), 4, 90));
  take(with_map({}, 5, 120));
  EXPECT_EQ(receiver_.stats().received, 5U);
  EXPECT_EQ(receiver_.stats().maps, 2U);
  EXPECT_EQ(receiver_.stats().maps_without_key, 1U);
  const Lighting latest = receiver_.latest({120 * kMs});
  ASSERT_TRUE(latest.environment());
  EXPECT_EQ(latest.environment()->sequence, 4U);
  EXPECT_EQ(latest.environment()->older_by.ns, 30 * kMs);
  EXPECT_TRUE(latest.environment()->map.whole());
  EXPECT_EQ(latest.radiance({1, 0, 0}, 1).value.r, 6);
}

TEST_F(EnvironmentReceiver, AMapIsTurnedWithTheOriginThatTheProbeMovesAround) {
  // The same light in the axes of a probe that turns by 0.5 about +Y: a map with the first descriptor alone.
  const Quat first = Quat::about(normalized(Vec3d{1, -2, 0.5}), 0.8), turn = Quat::about({0, 1, 0}, 0.5);
  Descriptor d = with_map(whole_map(), 1, 0);
  d.T_probe_origin.rotation = first;
  take(d);
  const Lighting before = receiver_.latest({0});
  d = with_map({}, 2, 100);
  d.T_probe_origin.rotation = turn * first;
  take(d);
  const Lighting after = receiver_.latest({100 * kMs});
  ASSERT_TRUE(after.environment());
  EXPECT_EQ(after.environment()->sequence, 1U);
  // The wire rounds rotations.
  for (const Vec3f v : test::directions())
    EXPECT_NEAR(after.radiance(rotate(turn, v), 0).value.r, before.radiance(v, 0).value.r, 1e-3);
  const Vec3f x = rotate(after.environment()->rotation, Vec3f{1, 0, 0});
  EXPECT_NEAR(length(x - rotate(turn, Vec3f{1, 0, 0})), 0, 1e-4);
  // Between the two: half of the turn.
  const Quat half = Quat::about({0, 1, 0}, 0.25);
  const Lighting between = receiver_.at({50 * kMs});
  for (const Vec3f v : test::directions())
    EXPECT_NEAR(between.radiance(rotate(half, v), 0).value.r, before.radiance(v, 0).value.r, 1e-3);
}

TEST_F(EnvironmentReceiver, QueryInThePastUsesTheMapOfThatTime) {
  take(with_map({}, 1, 0));
  take(with_map(whole_map(), 2, 100));
  take(with_map({}, 3, 200));
  take(with_map(changes(whole_map(), 6), 4, 300));
  const auto rough_at = [&](std::int64_t ms) { return receiver_.at({ms * kMs}).radiance({0, 1, 0}, 1).value.r; };
  // Harmonics, which the wire rounds to 13 bits.
  EXPECT_NEAR(rough_at(0), 9, 2e-3);
  EXPECT_NEAR(rough_at(40), 9, 2e-3);
  EXPECT_EQ(rough_at(60), 5) << "between two, the map of the nearer";
  EXPECT_EQ(rough_at(100), 5);
  EXPECT_EQ(rough_at(240), 5);
  EXPECT_EQ(rough_at(260), 6);
  EXPECT_EQ(rough_at(310), 6);
}

}  // namespace
}  // namespace lightwell::core
