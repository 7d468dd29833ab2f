// The lighting descriptor as a value: what an estimator makes and an application asks.
//   Light, ErrorBound, Flags, Descriptor
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

inline constexpr std::size_t kMaxLights = 64;

/// A lamp, the sun, a window: a cap of uniform radiance.
struct Light {
  Vec3f direction;               ///< Unit, TOWARDS the light.
  Irradiance irradiance;         ///< Vector irradiance: the integral of L over its solid angle at normal incidence.
  float angular_radius_rad = 0;  ///< Of the uniform cap with the same second moment, 0 to pi/2.
  /// Of the direction in tangent_basis(direction), rad²: u·u, u·v, v·v.
  std::array<float, 3> direction_covariance{};
  std::uint32_t track = 0;  ///< Stays with the same lamp; 0 is not a track.

  friend bool operator==(const Light&, const Light&) = default;
};

/// What units the radiances and irradiances of a descriptor have.
enum class Units : std::uint8_t {
  relative = 1,  ///< Proportional to cd/m² and lux by one unknown factor.
  absolute = 2,  ///< Luminance in cd/m² and lux.
};

/// Why an answer may be wrong.
enum class Flag : std::uint8_t {
  unseen = 1,   ///< A part of the sphere was never seen; its light is missing.
  clipped = 2,  ///< Pixels saturated in every exposure; their energy is a lower bound.
  cleaned = 3,  ///< The input held NaN, infinite or negative radiance, which was replaced.
  dark = 4,     ///< Nothing but darkness: no relative error can be stated.
  moved = 5,    ///< Something moved between the exposures of a bracket; there the light is that of the shortest, and of
                ///< those that agree with it.
  filled = 6,   ///< What no pixel sees was filled in by choice; no bound speaks of it.
  recovered = 7,  ///< The energy of saturated pixels was recovered from a meter's or a grey patch's reading.
  unsure = 8,     ///< What was seen fits several lights: the strongest's covariance is wide, or it was not seen at all.
  newer = 31,     ///< Of a reader alone: the probe gave a reason that this version has no name for.
};
/// Those of the wire.
inline constexpr std::array kWireFlags = {Flag::unseen, Flag::clipped, Flag::cleaned,   Flag::dark,
                                          Flag::moved,  Flag::filled,  Flag::recovered, Flag::unsure};
inline constexpr std::array kFlags = {Flag::unseen, Flag::clipped,   Flag::cleaned, Flag::dark, Flag::moved,
                                      Flag::filled, Flag::recovered, Flag::unsure,  Flag::newer};

[[nodiscard]] constexpr std::string_view to_string(Flag flag) {
  switch (flag) {
    case Flag::unseen:
      return "unseen";
    case Flag::clipped:
      return "clipped";
    case Flag::cleaned:
      return "cleaned";
    case Flag::dark:
      return "dark";
    case Flag::moved:
      return "moved";
    case Flag::filled:
      return "filled";
    case Flag::recovered:
      return "recovered";
    case Flag::unsure:
      return "unsure";
    case Flag::newer:
      return "newer";
  }
  return "unknown";
}

/// Points of the measured trade between time, bytes and accuracy, cheapest first: config.proto.
enum class Setting : std::uint8_t { fast = 1, balanced = 2, exact = 3 };
inline constexpr std::array kSettings = {Setting::fast, Setting::balanced, Setting::exact};

[[nodiscard]] constexpr std::string_view to_string(Setting setting) {
  switch (setting) {
    case Setting::fast:
      return "fast";
    case Setting::balanced:
      return "balanced";
    case Setting::exact:
      return "exact";
  }
  return "unknown";
}

/// Whether the light flickers with the mains.
enum class Flicker : std::uint8_t {
  unknown = 0,  ///< Nothing in these frames could show it.
  none = 1,
  hz100 = 2,
  hz120 = 3,
};

[[nodiscard]] constexpr std::string_view to_string(Flicker flicker) {
  switch (flicker) {
    case Flicker::unknown:
      return "unknown";
    case Flicker::none:
      return "none";
    case Flicker::hz100:
      return "100 Hz";
    case Flicker::hz120:
      return "120 Hz";
  }
  return "unknown";
}

/// A set of flags.
class Flags {
 public:
  constexpr void set(Flag f) { bits_ |= bit(f); }
  [[nodiscard]] constexpr bool has(Flag f) const { return (bits_ & bit(f)) != 0; }
  [[nodiscard]] constexpr bool any() const { return bits_ != 0; }
  friend constexpr bool operator==(Flags, Flags) = default;

 private:
  static constexpr std::uint32_t bit(Flag f) { return 1U << static_cast<unsigned>(f); }
  std::uint32_t bits_ = 0;
};

/// Of the irradiance: RMS over all normals of the error, relative to the RMS irradiance; the larger of the
/// luminance-weighted figure and the plain one over three channels. Infinite where the flags say why. On the wire in
/// millionths, rounded up.
struct ErrorBound {
  float total = 0;
  float truncation = 0;    ///< Bands that were not kept, and what caps do not describe of lights.
  float sampling = 0;      ///< Finite pixels and blocks.
  float noise = 0;         ///< Shot, read and quantisation noise of the sensor.
  float quantization = 0;  ///< Rounding to the wire.
  float smoothing = 0;     ///< What smoothing over time left out of this frame.

  friend bool operator==(const ErrorBound&, const ErrorBound&) = default;
};

/// When the light was so. Latencies are of the probe.
struct CaptureTime {
  ProbeTime mid_exposure;
  Duration delivered_after;  ///< From mid-exposure to the camera handing over its last frame.
  Duration encoded_after;    ///< From mid-exposure to the encoded bytes.

  friend bool operator==(const CaptureTime&, const CaptureTime&) = default;
};

/// One frame's answer, in the probe's frame of axes.
struct Descriptor {
  std::uint64_t sequence = 0;
  CaptureTime time;
  Units units = Units::relative;
  RadianceSh radiance;  ///< Of what is left after the lights were taken out.
  /// Encoding may round `radiance` to this step, or to the power of two below it: who needs no more saves bytes. 0: to
  /// the finest that the wire has. Not on the wire itself.
  float radiance_step = 0;
  std::vector<Light> lights;                  ///< Strongest first, at most kMaxLights.
  std::optional<EnvironmentMap> environment;  ///< For reflections; whole, or changes to a whole one; mostly absent.
  float coverage = 0;                         ///< Share of the sphere that some pixel saw.
  float saturated = 0;                        ///< Share of the seen sphere that was saturated in every exposure.
  ErrorBound bound;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  Flags flags;
  Setting setting = Setting::balanced;
  Flicker flicker = Flicker::unknown;

  friend bool operator==(const Descriptor&, const Descriptor&) = default;
};

/// FNV-1a, 32 bit: how probe_id is made of a name and calibration_id of canonical bytes.
[[nodiscard]] constexpr std::uint32_t fnv1a_32(std::string_view bytes) {
  std::uint32_t h = 2166136261U;
  for (const char c : bytes) h = (h ^ static_cast<unsigned char>(c)) * 16777619U;
  return h;
}

}  // namespace lightwell
