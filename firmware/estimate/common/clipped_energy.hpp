// Lights that were saturated in every exposure, and what a reading of irradiance tells of their energy (Debevec et al.
// 2004, "Estimating Surface Reflectance Properties of a Complex Scene under Captured Natural Illumination",
// section 4.2: the clipped sun from a diffuse sphere).
//
// A reading at a normal is the sum of what was seen, E_seen, and of what is missing. What is missing came from the
// clipped lights, so all of them are stronger than their lower bounds E_i by one factor g:
//   reading = E_seen - sum E_i k_i + g sum E_i k_i,   k_i: irradiance_of a receiver per vector irradiance of the cap.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <lightwell/descriptor.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A light some of whose pixels were saturated in every exposure.
struct ClippedLight {
  std::uint32_t track = 0;
  Irradiance measured;  ///< In the descriptor's units: a bound from below.
};

/// A reading of irradiance (luminance, in the descriptor's units) of a flat receiver: by a meter, or of a grey patch.
struct DiffuseConstraint {
  Vec3f normal;  ///< Unit, probe frame.
  double irradiance = 0;
};

/// A reading is trusted to this share of itself: luxmeters of class B (DIN 5032-7) and calibrated grey cards keep it.
inline constexpr double kMeterRelativeError = 0.05;
/// A light whose irradiance at the receiver is less than this share of its irradiance at normal incidence does not tell
/// enough: the reading's error would be five times as large a share of the light.
inline constexpr double kMinReceiverFactor = 0.2;

struct RecoveredLight {
  std::uint32_t track = 0;
  Irradiance irradiance;  ///< At normal incidence; at least what was measured.
  float uncertainty = 0;  ///< Of its luminance, from kMeterRelativeError.
};

/// What is known of lights while they stay clipped.
struct Recovery {
  std::array<RecoveredLight, kMaxLights> lights;
  std::size_t count = 0;
};

/// Why a reading tells nothing.
enum class RecoveryFault : std::uint8_t { none, no_reading, nothing_clipped, faces_away, below_observed };

/// Solves for the clipped lights of `d`, whose lights of the same tracks may hold an earlier recovery. Allocates
/// nothing. `out` is filled where the answer is none. A reading that is less than what was seen, by less than
/// kMeterRelativeError of it, finds nothing missing; by more, something is wrong with it.
[[nodiscard]] RecoveryFault recover(const Descriptor& d, std::span<const ClippedLight> clipped,
                                    const DiffuseConstraint& constraint, Recovery& out);
/// ok for none; invalid_argument for readings that cannot be; failed_precondition where they do not tell.
[[nodiscard]] Status status_of(RecoveryFault fault);

/// What applying a recovery found.
struct RecoveryResult {
  bool all = false;        ///< Every clipped light is known.
  double uncertainty = 0;  ///< Sum over the lights, luminance at normal incidence.
};

/// Sets the lights of `d` that are in `clipped` to what is known of them. Of lights that are no longer clipped `known`
/// forgets. With no light in `clipped`, `all` is false.
RecoveryResult apply(Recovery& known, std::span<const ClippedLight> clipped, Descriptor& d);

}  // namespace lightwell
