#include <gtest/gtest.h>

#include <fstream>
#include <lightwell/codec.hpp>
#include <sstream>

#include "golden_vectors.hpp"

namespace lightwell {
namespace {

std::string file(const std::string& name) {
  std::ifstream in(std::string(LIGHTWELL_VECTORS) + "/" + name, std::ios::binary);
  EXPECT_TRUE(in) << name << " is missing; run make_golden_vectors proto/vectors and look at the difference";
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(GoldenVectors, MadeAnewAreTheSameBytesAndTheSameJson) {
  Encoder encoder;
  for (const GoldenVector& v : golden_vectors()) {
    const auto bytes = encoder.encode(v.descriptor);
    ASSERT_TRUE(bytes.ok()) << v.name << ": " << bytes.status().message();
    const std::string made(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    EXPECT_EQ(made, file(v.name + ".bin")) << v.name;
    EXPECT_EQ(*descriptor_to_json(*bytes) + "\n", file(v.name + ".json")) << v.name;
  }
}

TEST(GoldenVectors, AreReadAsTheValuesTheyWereMadeOf) {
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

TEST(GoldenVectors, OfALampAtPlusXSayPlusX) {
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
