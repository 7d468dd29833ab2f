// Encoding of environment maps: round trip, size, and rejection of invalid maps.
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "golden_vectors.hpp"
#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {
namespace {

EnvironmentMap random_map(std::vector<EnvironmentLevel> levels) {
  std::mt19937 random(3);
  EnvironmentMap map;
  map.levels = std::move(levels);
  map.exponent = 5;
  map.key_interval_ms = 1000;
  map.texels.resize(texel_count(map.levels));
  for (std::uint32_t& t : map.texels) t = static_cast<std::uint32_t>(random());
  map.key = environment_key(map);
  return map;
}

EnvironmentMap small_map() { return random_map({{16, 0}, {8, 0.5F}, {8, 1}}); }

EnvironmentMap changes_of(const EnvironmentMap& whole) {
  EnvironmentMap map;
  map.key = whole.key;
  map.runs = {0, 2, 5, 1};
  map.texels = {1, 2, 0xFFFFFFFF};
  return map;
}

EnvironmentMap with_lights(EnvironmentMap map) {
  map.light_tracks = {3, 70000};
  map.light_runs = {5, 2, 248, 1};
  map.light_texels = {7, 8, 0xFFFFFFFF};
  return map;
}

Result<Descriptor> there_and_back(const Descriptor& d, std::size_t* bytes = nullptr) {
  Encoder encoder;
  const auto encoded = encoder.encode(d);
  if (!encoded.ok()) return encoded.status();
  if (bytes != nullptr) *bytes = encoded->size();
  return decode_descriptor(*encoded);
}

TEST(EnvironmentCodec, RoundTripsWholeMapsAndChanges) {
  const EnvironmentMap whole = small_map();
  EnvironmentMap nothing;
  nothing.key = whole.key;
  for (const EnvironmentMap& map : {whole, changes_of(whole), nothing, with_lights(whole), with_lights(nothing)}) {
    Descriptor d;
    d.environment = map;
    const auto back = there_and_back(d);
    ASSERT_TRUE(back.ok()) << back.status().message();
    EXPECT_EQ(back->environment, map);
  }
}

TEST(EnvironmentCodec, LargestDescriptorWithTheLargestMapFits) {
  Descriptor d = golden_vectors().back().descriptor;
  d.environment = random_map({{64, 0}, {64, 1}});
  ASSERT_EQ(d.environment->texels.size(), kMaxEnvironmentTexels);
  // Lights in every texel, and worse: in every other one.
  for (std::uint32_t track = 1; track <= kMaxLights; ++track)
    d.environment->light_tracks.push_back(0xFFFFFF00U + track);
  std::size_t bytes = 0;
  for (const std::uint32_t run : {4096U, 1U}) {
    d.environment->light_runs.clear();
    for (std::uint32_t at = 0; at < 4096; at += 2 * run)
      d.environment->light_runs.insert(d.environment->light_runs.end(), {run == 1 ? 1U : 0U, run});
    d.environment->light_texels.assign(run == 1 ? 2048 : 4096, 0xFFFFFFFF);
    EXPECT_TRUE(there_and_back(d, &bytes).ok());
    EXPECT_LE(bytes, kMaxDescriptorBytes);
  }
  // Worst case of changes: every other texel.
  EnvironmentMap worst;
  worst.key = d.environment->key;
  worst.light_tracks = d.environment->light_tracks;
  worst.light_runs = d.environment->light_runs;
  worst.light_texels = d.environment->light_texels;
  for (std::size_t k = 0; k < kMaxEnvironmentTexels / 2; ++k) {
    worst.runs.insert(worst.runs.end(), {1, 1});
    worst.texels.push_back(0xFFFFFFFF);
  }
  d.environment = worst;
  EXPECT_TRUE(there_and_back(d, &bytes).ok());
  EXPECT_LE(bytes, kMaxDescriptorBytes);
}

TEST(EnvironmentCodec, EncoderHandlesDescriptorsWithAndWithoutMaps) {
  Encoder encoder;
  Descriptor d;
  const auto size = [&] { return encoder.encode(d)->size(); };
  const std::size_t without = size();
  d.environment = small_map();
  const std::size_t with = size();
  EXPECT_EQ(size(), with);
  d.environment.reset();
  EXPECT_EQ(size(), without);
}

struct Refusal {
  const char* name;
  std::function<void(EnvironmentMap&)> spoil;
  bool rekey = true;  ///< Recompute the key, so that the named field is the reason of the rejection.
};

TEST(EnvironmentCodec, RejectsEncodingAndDecodingOfInvalidMaps) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Refusal> of_whole = {
      {"key is 0", [](EnvironmentMap& m) { m.key = 0; }, false},
      {"key does not match", [](EnvironmentMap& m) { ++m.key; }, false},
      {"key does not match", [](EnvironmentMap& m) { m.texels[7] ^= 1; }, false},
      {"edge must", [](EnvironmentMap& m) { m.levels[0].edge = 12; }},
      {"edge must", [](EnvironmentMap& m) { m.levels[0].edge = 128; }},
      {"edge must", [](EnvironmentMap& m) { m.levels[0].edge = 0; }},
      {"edge is larger", [](EnvironmentMap& m) { std::swap(m.levels[0].edge, m.levels[1].edge); }},
      {"roughness must be", [=](EnvironmentMap& m) { m.levels[1].roughness = nan; }},
      {"roughness must be", [](EnvironmentMap& m) { m.levels[0].roughness = -0.5F; }},
      {"roughness must be", [](EnvironmentMap& m) { m.levels[2].roughness = 1.5F; }},
      {"roughness must increase", [](EnvironmentMap& m) { m.levels[1].roughness = 0; }},
      {"are more than 8",
       [](EnvironmentMap& m) {
         m.levels.clear();
         for (int k = 0; k < 9; ++k) m.levels.push_back({8, static_cast<float>(k) / 8});
         m.texels.resize(texel_count(m.levels));
       }},
      {"more than 8192",
       [](EnvironmentMap& m) {
         m = random_map({{64, 0}, {64, 0.5F}, {8, 1}});
       }},
      {"does not match the levels", [](EnvironmentMap& m) { m.texels.pop_back(); }},
      {"does not match the levels", [](EnvironmentMap& m) { m.texels.push_back(0); }},
      {"exponent is out", [](EnvironmentMap& m) { m.exponent = 101; }},
      {"exponent is out", [](EnvironmentMap& m) { m.exponent = -151; }},
      {"runs: not allowed",
       [](EnvironmentMap& m) {
         m.runs = {1, 1};
       }},
  };
  const std::vector<Refusal> of_changes = {
      {"key is 0", [](EnvironmentMap& m) { m.key = 0; }, false},
      {"exponent: not allowed", [](EnvironmentMap& m) { m.exponent = 1; }, false},
      {"key_interval_ms: not allowed", [](EnvironmentMap& m) { m.key_interval_ms = 1; }, false},
      {"pairs", [](EnvironmentMap& m) { m.runs.push_back(1); }, false},
      {"empty", [](EnvironmentMap& m) { m.runs[2] = 0; }, false},
      {"empty", [](EnvironmentMap& m) { m.runs[1] = 0; }, false},
      {"exceed", [](EnvironmentMap& m) { m.runs[0] = 8192; }, false},
      {"exceed", [](EnvironmentMap& m) { m.runs[0] = m.runs[2] = 0xFFFFFFFF; }, false},
      {"does not match the runs", [](EnvironmentMap& m) { m.texels.pop_back(); }, false},
      {"does not match the runs", [](EnvironmentMap& m) { m.texels.push_back(0); }, false},
  };
  const std::vector<Refusal> of_lights = {
      {"light_tracks: there are more",
       [](EnvironmentMap& m) {
         for (std::uint32_t track = 70001; m.light_tracks.size() <= kMaxLights; ++track)
           m.light_tracks.push_back(track);
       },
       false},
      {"light_tracks: 0", [](EnvironmentMap& m) { m.light_tracks[0] = 0; }, false},
      {"light_tracks: they must", [](EnvironmentMap& m) { std::swap(m.light_tracks[0], m.light_tracks[1]); }, false},
      {"light_tracks: they must", [](EnvironmentMap& m) { m.light_tracks[1] = m.light_tracks[0]; }, false},
      {"light_runs: the number", [](EnvironmentMap& m) { m.light_runs.push_back(1); }, false},
      {"light_runs: one is empty", [](EnvironmentMap& m) { m.light_runs[2] = 0; }, false},
      {"light_runs: they exceed", [](EnvironmentMap& m) { m.light_runs[0] = 4096; }, false},
      {"light_runs: they exceed", [](EnvironmentMap& m) { m.light_runs[0] = m.light_runs[2] = 0xFFFFFFFF; }, false},
      {"light_texels: the length does not match", [](EnvironmentMap& m) { m.light_texels.pop_back(); }, false},
      {"one is empty", [](EnvironmentMap& m) { m.light_tracks.clear(); }, false},
      {"one is empty",
       [](EnvironmentMap& m) {
         m.light_runs.clear();
         m.light_texels.clear();
       },
       false},
  };
  const auto expect_refused = [](const EnvironmentMap& good, const Refusal& r) {
    EnvironmentMap bad = good;
    r.spoil(bad);
    if (r.rekey) bad.key = environment_key(bad);
    Encoder encoder;
    Descriptor d;
    d.environment = bad;
    const auto sent = encoder.encode(d);
    EXPECT_EQ(sent.status().code(), StatusCode::invalid_argument) << r.name;
    EXPECT_NE(sent.status().message().find(r.name), std::string::npos) << r.name << ": " << sent.status().message();
    EXPECT_NE(sent.status().message().find("environment."), std::string::npos);
    // The same map in a message, as another implementation could write it.
    d.environment.reset();
    const auto bytes = *encoder.encode(d);
    v1::LightingDescriptor m;
    ASSERT_TRUE(m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    v1::EnvironmentMap& map = *m.mutable_environment();
    map.set_key(bad.key);
    map.set_encoding(v1::EnvironmentMap::RGB9E5);
    for (const EnvironmentLevel& level : bad.levels) {
      v1::EnvironmentMap::Level& out = *map.add_levels();
      out.set_edge(static_cast<std::uint32_t>(level.edge));
      out.set_roughness(level.roughness);
    }
    map.set_exponent(bad.exponent);
    map.set_key_interval_ms(bad.key_interval_ms);
    for (const std::uint32_t t : bad.texels)
      for (int k = 0; k < 4; ++k) map.mutable_texels()->push_back(static_cast<char>(t >> (8 * k) & 255U));
    for (const std::uint32_t n : bad.runs) map.add_runs(n);
    for (const std::uint32_t n : bad.light_tracks) map.add_light_tracks(n);
    for (const std::uint32_t n : bad.light_runs) map.add_light_runs(n);
    for (const std::uint32_t t : bad.light_texels)
      for (int k = 0; k < 4; ++k) map.mutable_light_texels()->push_back(static_cast<char>(t >> (8 * k) & 255U));
    const std::string message = m.SerializeAsString();
    const auto read = decode_descriptor(std::as_bytes(std::span(message)));
    EXPECT_EQ(read.status().code(), StatusCode::invalid_argument) << r.name;
    EXPECT_NE(read.status().message().find(r.name), std::string::npos) << r.name << ": " << read.status().message();
  };
  const EnvironmentMap whole = small_map();
  for (const Refusal& r : of_whole) expect_refused(whole, r);
  for (const Refusal& r : of_changes) expect_refused(changes_of(whole), r);
  for (const Refusal& r : of_lights)
    for (const EnvironmentMap& map : {whole, changes_of(whole)}) expect_refused(with_lights(map), r);
  // Within any map, but not within the first level of this one.
  expect_refused(with_lights(whole), {"light_runs: they exceed", [](EnvironmentMap& m) { ++m.light_runs[0]; }, false});
}

TEST(EnvironmentCodec, RejectsWhatOnlyTheWireCanRepresent) {
  Encoder encoder;
  Descriptor d;
  d.environment = small_map();
  const auto bytes = *encoder.encode(d);
  const auto message_of = [&](auto&& spoil) {
    v1::LightingDescriptor m;
    EXPECT_TRUE(m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    spoil(*m.mutable_environment());
    const std::string message = m.SerializeAsString();
    return decode_descriptor(std::as_bytes(std::span(message))).status().message();
  };
  using M = v1::EnvironmentMap;
  EXPECT_NE(message_of([](M& m) { m.set_encoding(M::ENCODING_UNSPECIFIED); }).find("encoding"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.set_encoding(static_cast<M::Encoding>(2)); }).find("encoding"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_texels()->pop_back(); }).find("texels"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_levels(0)->set_edge(0xFFFFFFF0); }).find("edge"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.clear_levels(); }).find("environment."), std::string::npos);
}

}  // namespace
}  // namespace lightwell
