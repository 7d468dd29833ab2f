// Recovers the energy of lights that were saturated in every exposure from one reading of irradiance (Debevec et al.
// 2004, "Estimating Surface Reflectance Properties of a Complex Scene under Captured Natural Illumination",
// section 4.2: the clipped sun from a diffuse sphere).
//
// The difference between the reading at a normal and the observed irradiance E_seen is attributed to the clipped
// lights. All of them are assumed to exceed their lower bounds E_i by the same factor g:
//   reading = E_seen - sum E_i k_i + g sum E_i k_i,   k_i: irradiance of the receiver per vector irradiance of the cap.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <lightwell/descriptor.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A light of which some pixels were saturated in every exposure.
struct ClippedLight {
  std::uint32_t track = 0;
  Irradiance measured;  ///< In the descriptor's units; a lower bound.
};

/// A reading of the irradiance of a flat receiver (luminance, in the descriptor's units), by a meter or a grey patch.
struct DiffuseConstraint {
  Vec3f normal;  ///< Unit, probe frame.
  double irradiance = 0;
};

/// Relative error of a reading: luxmeters of class B (DIN 5032-7) and calibrated grey cards stay below it.
inline constexpr double kMeterRelativeError = 0.05;
/// Smallest ratio of the clipped lights' irradiance at the receiver to that at normal incidence. Below it, the relative
/// error of the recovered lights would be more than five times that of the reading.
inline constexpr double kMinReceiverFactor = 0.2;

struct RecoveredLight {
  std::uint32_t track = 0;
  Irradiance irradiance;  ///< At normal incidence; at least the measured lower bound.
  float uncertainty = 0;  ///< Of its luminance, due to kMeterRelativeError.
};

/// Recovered lights; valid while they stay clipped.
struct Recovery {
  std::array<RecoveredLight, kMaxLights> lights;
  std::size_t count = 0;
};

/// Reason why a reading cannot be used.
enum class RecoveryFault : std::uint8_t { none, no_reading, nothing_clipped, faces_away, below_observed };

/// Solves for the clipped lights of `d`, whose irradiances may contain an earlier recovery. Fills `out` where it
/// returns `none`; otherwise `out` is unchanged. A reading below the observed irradiance by at most kMeterRelativeError
/// of it leaves the lower bounds unchanged; a lower reading is refused (below_observed). Allocates nothing.
[[nodiscard]] RecoveryFault recover(const Descriptor& d, std::span<const ClippedLight> clipped,
                                    const DiffuseConstraint& constraint, Recovery& out);
/// ok for `none`; invalid_argument for readings that are impossible; failed_precondition where they determine nothing.
[[nodiscard]] Status status_of(RecoveryFault fault);

/// Result of applying a recovery.
struct RecoveryResult {
  bool all = false;        ///< Every clipped light was recovered.
  double uncertainty = 0;  ///< Sum over the lights, luminance at normal incidence.
};

/// Sets the irradiances of the lights of `d` that are in `clipped` to the recovered ones. Removes lights from `known`
/// that are no longer clipped. With no light in `clipped`, `all` is false.
RecoveryResult apply(Recovery& known, std::span<const ClippedLight> clipped, Descriptor& d);

}  // namespace lightwell
