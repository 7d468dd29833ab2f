#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/query.hpp>

#include "golden_vectors.hpp"
#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {
namespace {

std::vector<std::byte> encoded(const Descriptor& d) {
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return bytes.ok() ? std::vector<std::byte>(bytes->begin(), bytes->end()) : std::vector<std::byte>();
}

Descriptor lit(std::uint32_t seed, float scale) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  Descriptor d;
  d.radiance.band = 4;
  for (std::size_t i = 0; i < 25; ++i)
    d.radiance.c[i] = {scale * normal(random), scale * normal(random), scale * normal(random)};
  d.radiance.c[0] = {4 * scale, 4 * scale, 4 * scale};
  for (int i = 0; i < 3; ++i) {
    Light l;
    l.direction = normalized(Vec3f{normal(random), normal(random), normal(random)});
    l.irradiance = {scale * std::abs(normal(random)), scale, scale / 3};
    l.angular_radius_rad = 0.1F;
    d.lights.push_back(l);
  }
  d.coverage = 1;
  return d;
}

std::vector<Vec3f> normals() {
  std::vector<Vec3f> out;
  for (int i = 0; i < 2048; ++i) out.push_back(vec_cast<float>(fibonacci_direction(i, 2048)));
  return out;
}

TEST(Codec, RoundTripsEveryFieldOfTheLargestDescriptor) {
  const Descriptor d = golden_vectors().back().descriptor;
  const auto back = decode_descriptor(encoded(d));
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(back->sequence, d.sequence);
  EXPECT_EQ(back->time, d.time);
  EXPECT_EQ(back->units, d.units);
  EXPECT_EQ(back->environment, d.environment);
  EXPECT_EQ(back->coverage, d.coverage);
  EXPECT_EQ(back->saturated, d.saturated);
  EXPECT_EQ(back->bound, d.bound);
  EXPECT_EQ(back->probe_id, d.probe_id);
  EXPECT_EQ(back->calibration_id, d.calibration_id);
  EXPECT_EQ(back->flags, d.flags);
}

TEST(Codec, IrradianceErrorIsWithinWireError) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    for (const float scale : {1e-8F, 1.0F, 1e8F}) {
      const Descriptor d = lit(seed, scale);
      const auto back = decode_descriptor(encoded(d));
      ASSERT_TRUE(back.ok());
      double error = 0, whole = 0;
      for (const Vec3f& n : normals()) {
        const Irradiance a = irradiance_at(d, n), b = irradiance_at(*back, n);
        for (int k = 0; k < 3; ++k) {
          error += std::pow(a[k] - b[k], 2.0);
          whole += std::pow(a[k], 2.0);
        }
      }
      const double rms = std::sqrt(whole / (3 * 2048)), relative = std::sqrt(error / whole);
      EXPECT_LE(relative, wire_error(d, rms)) << seed << " " << scale;
      // The rounding of the wire format must be negligible: 0.1 % of an irradiance of ten terms.
      EXPECT_LE(wire_error(d, rms), 1e-3);
    }
  }
}

TEST(Codec, ConstantSphereSendsOnlyBandZero) {
  Descriptor d;
  d.radiance.band = 6;
  d.radiance.c[0] = {1, 1, 1};
  d.radiance.c[30] = {1e-6F, 0, 0};  // Rounding of an estimator.
  const auto back = decode_descriptor(encoded(d));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->radiance.band, 0);
}

TEST(Codec, KeepsTheBoundOfATypicalDescriptorUnderTheBudget) {
  // proto/README.md: band 4 without lights at most 190 bytes, a light at most 45.
  Descriptor d = lit(1, 1);
  const std::size_t with_lights = encoded(d).size();
  d.lights.clear();
  const std::size_t without = encoded(d).size();
  EXPECT_LE(without, 230U);
  EXPECT_LE((with_lights - without) / 3, 45U);
}

TEST(Codec, RejectsEncodingOfInvalidValues) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  Encoder encoder;
  const auto refused = [&](auto&& spoil) {
    Descriptor d = lit(1, 1);
    spoil(d);
    return encoder.encode(d).status().code() == StatusCode::invalid_argument;
  };
  EXPECT_TRUE(refused([&](Descriptor& d) { d.radiance.c[3].g = nan; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.radiance.c[3].g = inf; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.radiance.band = 7; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.lights[0].direction = {}; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.lights[0].irradiance.b = nan; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.lights[0].angular_radius_rad = -1; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.lights.resize(65, d.lights[0]); }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.coverage = nan; }));
  EXPECT_TRUE(refused([&](Descriptor& d) { d.bound.total = nan; }));
  EXPECT_TRUE(encoder.encode(lit(1, 1)).ok()) << "and goes on after a refusal";
}

TEST(Codec, RejectsInvalidMessagesNamingTheField) {
  const std::vector<std::byte> good = encoded(lit(1, 1));
  const auto message_of = [&](auto&& spoil) {
    v1::LightingDescriptor m;
    EXPECT_TRUE(m.ParseFromArray(good.data(), static_cast<int>(good.size())));
    spoil(m);
    const std::string bytes = m.SerializeAsString();
    const auto d = decode_descriptor(std::as_bytes(std::span(bytes)));
    EXPECT_EQ(d.status().code(), StatusCode::invalid_argument);
    return d.status().message();
  };
  using M = v1::LightingDescriptor;
  EXPECT_NE(message_of([](M& m) { m.set_wire_version(2); }).find("wire_version"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_radiance()->set_bands(128); }).find("band"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_radiance()->add_mantissa(1); }).find("mantissa"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_radiance()->set_mantissa(0, 8192); }).find("mantissa"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_radiance()->set_exponent(200); }).find("exponent"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_lights(0)->clear_direction(); }).find("direction"), std::string::npos);
  EXPECT_NE(message_of([](M& m) {
              for (int k = 0; k < 3; ++k) m.mutable_lights(0)->set_direction(k, 0);
            }).find("direction"),
            std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_lights(0)->set_angular_radius_e5(200000); }).find("radius"),
            std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.set_unseen(2); }).find("coverage"), std::string::npos);
  // 1 minus this is 1.
  EXPECT_NE(message_of([](M& m) { m.set_unseen(-1e-26F); }).find("unseen"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.mutable_environment()->set_key(1); }).find("environment"), std::string::npos);
  EXPECT_NE(message_of([](M& m) { m.set_units(v1::UNITS_UNSPECIFIED); }).find("units"), std::string::npos);
}

TEST(Codec, PassesOverFieldsThatItDoesNotKnow) {
  std::vector<std::byte> bytes = encoded(lit(1, 1));
  // Field 1000, length-delimited, "new".
  for (const int b : std::initializer_list<int>{0xC2, 0x3E, 0x03, 'n', 'e', 'w'})
    bytes.push_back(static_cast<std::byte>(b));
  EXPECT_TRUE(decode_descriptor(bytes).ok());
}

TEST(Codec, RoundTripsEachFlag) {
  for (const Flag flag : kWireFlags) {
    Descriptor d = lit(1, 1);
    d.flags = {};
    d.flags.set(flag);
    const auto back = decode_descriptor(encoded(d));
    ASSERT_TRUE(back.ok()) << to_string(flag);
    EXPECT_EQ(back->flags, d.flags) << to_string(flag);
  }
}

/// A flag number after the last known one, as an older reader sees the newest flag.
TEST(Codec, UnknownFlagIsDecodedAsNewer) {
  Descriptor d = lit(1, 1);
  d.flags = {};
  d.flags.set(kWireFlags.back());
  std::vector<std::byte> bytes = encoded(d);
  // Field 13 (flags), packed: one number.
  const std::array<std::byte, 3> of_the_wire = {std::byte{0x6A}, std::byte{1},
                                                static_cast<std::byte>(kWireFlags.back())};
  const auto at = std::ranges::find_end(bytes, of_the_wire);
  ASSERT_FALSE(at.empty());
  at.back() = static_cast<std::byte>(static_cast<int>(kWireFlags.back()) + 1);
  const auto read = decode_descriptor(bytes);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_TRUE(read->flags.has(Flag::newer));
  EXPECT_FALSE(read->flags.has(kWireFlags.back()));
}

TEST(Codec, SurvivesEveryTruncationAndRandomDamage) {
  const std::vector<std::byte> good = encoded(golden_vectors().back().descriptor);
  for (std::size_t n = 0; n < good.size(); ++n) (void)decode_descriptor(std::span(good).first(n));
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::byte> bad = good;
    for (int k = 0; k < 3; ++k) bad[random() % bad.size()] = static_cast<std::byte>(random());
    const auto d = decode_descriptor(bad);
    if (!d) continue;
    // An accepted message is a descriptor that can be encoded again: no NaN, nothing out of range.
    Encoder encoder;
    EXPECT_TRUE(encoder.encode(*d).ok());
  }
  EXPECT_FALSE(decode_descriptor(std::vector<std::byte>(kMaxDescriptorBytes + 1)).ok());
}

TEST(Codec, JsonRoundTripGivesTheSameBytes) {
  const std::vector<std::byte> bytes = encoded(lit(3, 1));
  const auto json = descriptor_to_json(bytes);
  ASSERT_TRUE(json.ok());
  const auto back = descriptor_from_json(*json);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

}  // namespace
}  // namespace lightwell
