// Upper limits of the sizes of a descriptor's parts against encoded messages.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/wire_size.hpp>

namespace lightwell {
namespace {

/// Of the radiance rounded to 2^exponent, which must be a step that the encoder takes as it is.
std::size_t radiance_bytes(const RadianceSh& sh, int exponent) {
  std::size_t mantissas = 0;
  for (int l = 0; l <= sh.band; ++l) {
    std::size_t bytes = 0;
    bool zero = true;
    for (int i = l * l; i < sh_count(l); ++i)
      for (int k = 0; k < 3; ++k) {
        const auto m =
            static_cast<std::int32_t>(std::nearbyint(std::ldexp(sh.c[static_cast<std::size_t>(i)][k], -exponent)));
        bytes += mantissa_bytes(m);
        zero &= m == 0;
      }
    if (!zero || l == 0) mantissas += bytes;
  }
  return max_radiance_bytes(mantissas, exponent);
}

std::size_t limit_of(const Descriptor& d, int exponent) {
  std::size_t bytes = max_header_bytes(d) + max_bound_bytes(d.bound) + radiance_bytes(d.radiance, exponent);
  for (const Light& light : d.lights) bytes += max_light_bytes(light);
  return bytes;
}

TEST(WireSize, OfRandomDescriptorsIsAnUpperLimit) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto decades = [&](float least, float most) { return std::pow(10.0F, least + (most - least) * unit(random)); };
  Encoder encoder;
  std::size_t largest_excess = 0;
  for (int i = 0; i < 20'000; ++i) {
    Descriptor d;
    d.sequence = random() >> (random() % 64);
    d.time.mid_exposure.ns = static_cast<std::int64_t>(random() >> 1);
    d.time.delivered_after.ns = static_cast<std::int64_t>(decades(0, 16));
    d.time.encoded_after.ns = std::numeric_limits<std::int64_t>::max();
    const float brightness = decades(-30, 25);
    d.radiance.band = static_cast<int>(random() % 7);
    for (std::size_t k = 0; k < static_cast<std::size_t>(d.radiance.count()); ++k)
      for (int c = 0; c < 3; ++c)
        if (random() % 4 != 0) d.radiance.c[k][c] = brightness * (k == 0 ? 1 : unit(random) - 0.5F);
    d.radiance.c[0].r = brightness;
    int exponent = 0;
    (void)std::frexp(brightness, &exponent);
    exponent += static_cast<int>(random() % 14) - 12;
    d.radiance_step = std::ldexp(1.0F, exponent);
    for (std::size_t n = random() % 4; n > 0; --n) {
      Light light;
      light.direction = normalized(Vec3f{unit(random) - 0.5F, unit(random) - 0.5F, unit(random) + 0.01F});
      const float e = decades(-30, 25);
      light.irradiance = {e, e * unit(random), random() % 2 == 0 ? 0 : e};
      light.angular_radius_rad = unit(random) * unit(random) * 1.57F;
      const float v = random() % 3 == 0 ? 0 : decades(-20, 0);
      light.direction_covariance = {v, random() % 2 == 0 ? 0 : v / 3, v};
      light.track = static_cast<std::uint32_t>(random() >> (32 + random() % 32));
      if (random() % 2 == 0) light.distance_m = decades(-3, 5), light.distance_sigma_m = decades(-5, 5);
      d.lights.push_back(light);
    }
    d.coverage = random() % 2 == 0 ? 1 : unit(random);
    d.saturated = random() % 2 == 0 ? 0 : unit(random);
    for (float* part : {&d.bound.total, &d.bound.truncation, &d.bound.sampling, &d.bound.noise, &d.bound.quantization,
                        &d.bound.smoothing})
      *part = random() % 4 == 0 ? 0 : random() % 4 == 0 ? std::numeric_limits<float>::infinity() : decades(-8, 6);
    d.probe_id = d.calibration_id = 0xFFFFFFFF;
    for (const Flag flag : kWireFlags)
      if (random() % 3 == 0) d.flags.set(flag);
    d.flicker = static_cast<Flicker>(random() % 4);
    if (random() % 4 == 0) d.T_probe_origin.translation = {1, 2, 3};
    const std::size_t limit = limit_of(d, exponent);
    const auto bytes = encoder.encode(d);
    ASSERT_TRUE(bytes.ok()) << bytes.status().message();
    ASSERT_LE(bytes->size(), limit) << i;
    if (!d.flags.has(Flag::clipped) && d.lights.empty() && d.T_probe_origin == Pose{})
      largest_excess = std::max(largest_excess, limit - bytes->size());
    // Another irradiance, as of a recovered light, needs no more.
    if (d.flags.has(Flag::clipped)) d.flags.set(Flag::recovered);
    for (Light& light : d.lights) light.irradiance = {decades(20, 25), decades(-20, 25), 1};
    ASSERT_LE(encoder.encode(d)->size(), limit) << i;
  }
  // Common zeros of all mantissas save a byte of each, of band 0 alone: three, and the exponent: two.
  EXPECT_LE(largest_excess, 6U);
}

TEST(WireSize, TheLeastLimitHoldsBand0AndTheTotalOfTheBound) {
  Descriptor d;
  d.sequence = std::numeric_limits<std::uint64_t>::max();
  d.time.mid_exposure.ns = d.time.delivered_after.ns = d.time.encoded_after.ns =
      std::numeric_limits<std::int64_t>::max();
  d.coverage = d.saturated = 0.3F;
  d.bound.total = std::numeric_limits<float>::infinity();
  d.probe_id = d.calibration_id = 0xFFFFFFFF;
  for (const Flag flag : kWireFlags)
    if (flag != Flag::unsure) d.flags.set(flag);  // Which no panorama has.
  d.flicker = Flicker::hz120;
  for (const float scale : {1e-37F, 1.0F, 1e30F}) {
    d.radiance.c[0] = {4099 * scale, 4097 * scale, 4095 * scale};
    EXPECT_LE(max_header_bytes(d) + max_bound_bytes(d.bound) + kMaxBand0Bytes, std::size_t{kMinMaxBytes});
    EXPECT_LE(Encoder().encode(d)->size(), std::size_t{kMinMaxBytes});
  }
  EXPECT_EQ(max_radiance_bytes(3 * mantissa_bytes(8191), 100), kMaxBand0Bytes);
}

}  // namespace
}  // namespace lightwell
