#include <string>

#include <gtest/gtest.h>

#include <lightwell/bytes.hpp>
#include <lightwell/codec.hpp>

#include "golden_vectors.hpp"
#include "support/read_file.hpp"

namespace lightwell {
namespace {

std::string file(const std::string& name) {
  const std::string text = test::read_file(std::string(LIGHTWELL_VECTORS) + "/" + name);
  EXPECT_FALSE(text.empty()) << name << " is missing; run make_golden_vectors proto/vectors and look at the difference";
  return text;
}

TEST(GoldenVectors, RegenerationGivesTheSameBytesAndJson) {
  Encoder encoder;
  for (const GoldenVector& v : golden_vectors()) {
    const auto bytes = encoder.encode(v.descriptor);
    ASSERT_TRUE(bytes.ok()) << v.name << ": " << bytes.status().message();
    const std::string made(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    EXPECT_EQ(made, file(v.name + ".bin")) << v.name;
    EXPECT_EQ(*descriptor_to_json(*bytes) + "\n", file(v.name + ".json")) << v.name;
  }
}

TEST(GoldenVectors, DecodeToTheValuesTheyWereMadeFrom) {
  for (const GoldenVector& v : golden_vectors()) {
    const std::string bytes = file(v.name + ".bin");
    const auto d = decode_descriptor(std::as_bytes(std::span(bytes)));
    ASSERT_TRUE(d.ok()) << v.name << ": " << d.status().message();
    EXPECT_EQ(d->sequence, v.descriptor.sequence);
    EXPECT_EQ(d->lights.size(), v.descriptor.lights.size());
    EXPECT_EQ(d->flags, v.descriptor.flags);
    EXPECT_EQ(d->bound, v.descriptor.bound);
    EXPECT_EQ(d->environment, v.descriptor.environment);
    for (std::size_t i = 0; i < static_cast<std::size_t>(v.descriptor.radiance.count()); ++i)
      // Half a step of 13 bits of the largest coefficient of the vector.
      EXPECT_NEAR(d->radiance.c[i].r, v.descriptor.radiance.c[i].r, 8191.0 / 8191 / 2 + 1e-3) << v.name << " " << i;
  }
}

/// Version 1 of the wire format is frozen: these bytes must stay decodable. Vectors may be added, but not changed.
TEST(GoldenVectors, OfVersion1AreUnchanged) {
  struct Frozen {
    const char* name;
    std::size_t bytes;
    std::uint32_t crc32c;
  };
  for (const Frozen& f : {Frozen{"v1_constant", 68, 0x35079315}, Frozen{"v1_environment_changes", 97, 0x9b52980f},
                          Frozen{"v1_fullest", 3613, 0xc5141bb8}, Frozen{"v1_lamp_at_plus_x", 141, 0x2d2dbf33},
                          Frozen{"v1_near_lamp", 237, 0x67d37f31}, Frozen{"v1_smallest", 35, 0x314b523e}}) {
    const std::string bytes = file(std::string(f.name) + ".bin");
    EXPECT_EQ(bytes.size(), f.bytes) << f.name;
    EXPECT_EQ(crc32c(std::as_bytes(std::span(bytes))), f.crc32c) << f.name;
    EXPECT_TRUE(decode_descriptor(std::as_bytes(std::span(bytes))).ok()) << f.name;
  }
}

/// A message of a newer probe: with unknown fields, flags and settings.
TEST(GoldenVectors, MessagesOfANewerProbeAreDecodedAsFarAsKnown) {
  const std::string known = file("v1_lamp_at_plus_x.bin");
  const auto plain = decode_descriptor(std::as_bytes(std::span(known)));
  ASSERT_TRUE(plain.ok());
  // Field 14 (setting) 9, field 13 (flags) 2 and 200, field 15 (flicker) 77, field 900 a text: protobuf's own encoding.
  std::string newer = known + std::string("\x70\x09", 2) + std::string("\x6a\x03\x02\xc8\x01", 5) +
                      std::string("\x78\x4d", 2) + std::string("\xa2\x38\x05later", 8);
  const auto d = decode_descriptor(std::as_bytes(std::span(newer)));
  ASSERT_TRUE(d.ok()) << d.status().message();
  EXPECT_EQ(d->lights.size(), plain->lights.size());
  EXPECT_EQ(d->radiance, plain->radiance);
  EXPECT_TRUE(d->flags.has(Flag::clipped));
  EXPECT_TRUE(d->flags.has(Flag::newer));
  EXPECT_FALSE(plain->flags.has(Flag::newer));
  EXPECT_EQ(d->flicker, Flicker::unknown);
  // Flag::newer is set by the decoder only and never encoded.
  Encoder encoder;
  const auto again = encoder.encode(*d);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(decode_descriptor(*again)->flags.has(Flag::newer));
}

TEST(GoldenVectors, LightAtPlusXHasDirectionPlusX) {
  const std::string bytes = file("v1_lamp_at_plus_x.bin");
  const auto d = decode_descriptor(std::as_bytes(std::span(bytes)));
  ASSERT_TRUE(d.ok());
  EXPECT_EQ(d->lights[0].direction, (Vec3f{1, 0, 0}));
  EXPECT_NEAR(d->lights[0].irradiance.r, 10, 10.0 / 8191);
  EXPECT_NEAR(d->lights[0].angular_radius_rad, 0.05, 1e-5);
  EXPECT_EQ(d->lights[0].track, 3U);
}

}  // namespace
}  // namespace lightwell
