// Scenes whose irradiance is known in closed form.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/recording.hpp>

namespace lightwell::test {

/// The same radiance from everywhere: the constant function is 1 / sqrt(4 pi) times the first
/// coefficient.
inline Descriptor constant_scene(Radiance radiance) {
  constexpr float kSqrt4Pi = 3.5449077018F;
  Descriptor descriptor;
  descriptor.units = Units::absolute;
  descriptor.radiance.band = 0;
  descriptor.radiance.c[0] = radiance * kSqrt4Pi;
  descriptor.coverage = 1;
  return descriptor;
}

inline Light light(Vec3f direction, Irradiance irradiance, float rho = 0, std::uint32_t track = 1) {
  Light out;
  out.direction = normalized(direction);
  out.irradiance = irradiance;
  out.angular_radius_rad = rho;
  out.track = track;
  return out;
}

inline Descriptor one_light(Vec3f direction, Irradiance irradiance, float rho = 0) {
  Descriptor descriptor;
  descriptor.lights.push_back(light(direction, irradiance, rho));
  return descriptor;
}

/// A descriptor whose radiance encodes its sequence number, so that a mixture of two is detected.
inline Descriptor numbered(std::uint64_t sequence, std::int64_t mid_exposure_ns) {
  Descriptor descriptor = constant_scene(Radiance{1, 1, 1} * static_cast<float>(sequence));
  descriptor.sequence = sequence;
  descriptor.time.mid_exposure.ns = mid_exposure_ns;
  descriptor.time.delivered_after = {2'000'000};
  descriptor.time.encoded_after = {3'000'000};
  descriptor.lights.push_back(light({0, 1, 0}, Irradiance{1, 1, 1} * static_cast<float>(sequence), 0.1F));
  descriptor.probe_id = 7;
  descriptor.calibration_id = 9;
  return descriptor;
}

/// Empty if it cannot be encoded, which makes the test fail.
inline std::string encoded(const Descriptor& descriptor) {
  Encoder encoder;
  const auto bytes = encoder.encode(descriptor);
  if (!bytes.ok()) return {};
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

inline std::span<const std::byte> as_bytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// Ten directions in all octants that are on no axis, and the six axes.
inline std::vector<Vec3f> directions() {
  return {{0.3F, 0.8F, -0.5F}, {-0.7F, 0.2F, 0.6F}, {0.1F, -0.9F, 0.4F}, {-0.5F, -0.5F, -0.7F},
          {0.9F, 0.1F, 0.2F},  {-0.2F, 0.3F, 0.9F}, {0.6F, -0.6F, 0.5F}, {-0.8F, 0.6F, -0.1F},
          {0.4F, 0.4F, -0.8F}, {0.05F, -0.3F, -1},  {1, 0, 0},           {-1, 0, 0},
          {0, 1, 0},           {0, -1, 0},          {0, 0, 1},           {0, 0, -1}};
}

}  // namespace lightwell::test
