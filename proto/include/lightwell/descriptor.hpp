// The lighting descriptor as a value: produced by an estimator, evaluated by an application.
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

/// A detected light (lamp, sun, window), modelled as a spherical cap of uniform radiance.
struct Light {
  Vec3f direction;               ///< Unit, TOWARDS the light.
  Irradiance irradiance;         ///< At normal incidence: the magnitude of the vector irradiance of the cap.
  float angular_radius_rad = 0;  ///< Radius of the uniform cap with the same second moment, 0 to pi/2.
  /// Covariance of the direction in tangent_basis(direction), rad²: u·u, u·v, v·v. Positive semi-definite, up to the
  /// rounding of floats if it was rotated; the codec removes that.
  std::array<float, 3> direction_covariance{};
  std::uint32_t track = 0;  ///< Identity over time: the same light keeps its track. 0: not tracked.
  /// From the descriptor's origin, for a near lamp; lightwell::light_position() is its position. 0: distant, or not
  /// known.
  float distance_m = 0;
  float distance_sigma_m = 0;  ///< Standard deviation of the distance; 0 if the distance is 0, and only then.

  friend bool operator==(const Light&, const Light&) = default;
};

/// Unit of the radiances and irradiances of a descriptor.
enum class Units : std::uint8_t {
  relative = 1,  ///< Proportional to cd/m² and lux by one unknown factor.
  absolute = 2,  ///< Luminance in cd/m², illuminance in lux.
};

/// Conditions under which an estimate may be wrong.
enum class Flag : std::uint8_t {
  unseen = 1,     ///< No pixel sees a part of the sphere; its light is missing.
  clipped = 2,    ///< Pixels saturated in every exposure; their energy is a lower bound.
  cleaned = 3,    ///< The input held NaN, infinite or negative radiance, which was replaced.
  dark = 4,       ///< The frame is dark: no relative error can be stated.
  moved = 5,      ///< Something moved between the exposures of a bracket; there the radiance is that of the shortest
                  ///< exposure and of those that agree with it. Or light changed where an interleaved frame was not
                  ///< read; there it is older by up to the rotation's length.
  filled = 6,     ///< Directions that no pixel sees were filled as configured (UnseenFill); no error bound covers them.
  recovered = 7,  ///< The energy of saturated pixels was recovered from a lux meter, from the grey patch, or from
                  ///< the light that a glossy plane reflects diffusely.
  unsure = 8,     ///< The observations fit several light directions: the strongest light's covariance is wide, the
                  ///< light may be very near, or it was not observed at all. Of a glossy plane: too little was seen, or
                  ///< the scale is too uncertain.
  newer = 31,     ///< Set by the decoder only: the probe set a flag that this version does not know.
};
/// The flags that the wire format has.
inline constexpr std::array kWireFlags = {Flag::unseen, Flag::clipped, Flag::cleaned,   Flag::dark,
                                          Flag::moved,  Flag::filled,  Flag::recovered, Flag::unsure};
inline constexpr std::array kFlags = {Flag::unseen, Flag::clipped,   Flag::cleaned, Flag::dark, Flag::moved,
                                      Flag::filled, Flag::recovered, Flag::unsure,  Flag::newer};

[[nodiscard]] constexpr std::string_view to_string(Flag flag) {
  constexpr std::string_view kNames[] = {"unknown", "unseen", "clipped",   "cleaned", "dark",
                                         "moved",   "filled", "recovered", "unsure"};
  if (flag == Flag::newer) return "newer";
  return kNames[flag <= Flag::unsure ? static_cast<std::size_t>(flag) : 0];
}

/// Trade-off between computation time, bytes and accuracy. Meanings: config.proto.
enum class Setting : std::uint8_t { fast = 1, balanced = 2, exact = 3, fastest = 4 };
/// Cheapest first.
inline constexpr std::array kSettings = {Setting::fastest, Setting::fast, Setting::balanced, Setting::exact};

[[nodiscard]] constexpr std::string_view to_string(Setting setting) {
  constexpr std::string_view kNames[] = {"unknown", "fast", "balanced", "exact", "fastest"};
  return kNames[setting <= Setting::fastest ? static_cast<std::size_t>(setting) : 0];
}

/// Flicker of the light at twice the mains frequency.
enum class Flicker : std::uint8_t {
  unknown = 0,  ///< Cannot be determined from these frames.
  none = 1,
  hz100 = 2,
  hz120 = 3,
};

[[nodiscard]] constexpr std::string_view to_string(Flicker flicker) {
  constexpr std::string_view kNames[] = {"unknown", "none", "100 Hz", "120 Hz"};
  return kNames[flicker <= Flicker::hz120 ? static_cast<std::size_t>(flicker) : 0];
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

/// Bound of the irradiance error: RMS over all normals, relative to the RMS irradiance; the larger of the
/// luminance-weighted RMS and the unweighted RMS over the three channels. Infinite where no bound exists; the flags
/// give the reason. On the wire in millionths, rounded up.
struct ErrorBound {
  float total = 0;
  float truncation = 0;    ///< Omitted SH bands, and the deviation of real lights from uniform caps.
  float sampling = 0;      ///< Finite size of pixels and blocks.
  float noise = 0;         ///< Shot, read and quantisation noise of the sensor.
  float quantization = 0;  ///< Rounding in the wire format.
  float smoothing = 0;     ///< Difference between the smoothed estimate and this frame alone.

  friend bool operator==(const ErrorBound&, const ErrorBound&) = default;
};

/// Time of the observation, and the latencies of the probe.
struct CaptureTime {
  ProbeTime mid_exposure;
  Duration delivered_after;  ///< From mid-exposure to the delivery of the bracket's last frame by the camera.
  Duration encoded_after;    ///< From mid-exposure to the encoded bytes.

  friend bool operator==(const CaptureTime&, const CaptureTime&) = default;
};

/// The estimate of one frame: the light at the origin. Directions are in the probe's axes.
struct Descriptor {
  std::uint64_t sequence = 0;
  CaptureTime time;
  Units units = Units::relative;
  RadianceSh radiance;  ///< Radiance without the lights.
  /// Step to which the encoder may round `radiance` (it takes the power of two at or below), to save bytes. 0: the
  /// finest step of the wire format. Not transmitted.
  float radiance_step = 0;
  std::vector<Light> lights;                  ///< Strongest first, at most kMaxLights.
  std::optional<EnvironmentMap> environment;  ///< For reflections; a whole map or changes to one; usually absent.
  float coverage = 0;                         ///< Fraction of the sphere that at least one pixel sees.
  float saturated = 0;                        ///< Fraction of the seen part that is saturated in every exposure.
  ErrorBound bound;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  Flags flags;
  Setting setting = Setting::balanced;
  Flicker flicker = Flicker::unknown;
  /// Pose of the origin in the probe's frame. The light holds at its translation (m); for a marker its rotation is that
  /// of the body's axes. Turns no other member. The identity: the origin is the probe.
  Pose T_probe_origin;

  friend bool operator==(const Descriptor&, const Descriptor&) = default;
};

/// FNV-1a hash, 32 bit. probe_id is that of the probe's name, calibration_id that of the calibration's canonical bytes.
[[nodiscard]] constexpr std::uint32_t fnv1a_32(std::string_view bytes) {
  std::uint32_t h = 2166136261U;
  for (const char c : bytes) h = (h ^ static_cast<unsigned char>(c)) * 16777619U;
  return h;
}

}  // namespace lightwell
