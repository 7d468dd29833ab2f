// Common part of all conversions: nine SH coefficients in the target's axes, and a separate main light.
#pragma once

#include <array>
#include <optional>

#include <lightwell/conventions.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::core {

/// Rows of the matrix from Lightwell's axes to the target's.
struct Axes {
  Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  [[nodiscard]] constexpr Vec3d of(Vec3d ours) const { return {dot(x, ours), dot(y, ours), dot(z, ours)}; }
};

/// Right-handed, +Y up, -Z forward.
inline constexpr Axes kOurAxes{};
/// Left-handed, +Y up, +Z forward.
inline constexpr Axes kUnityAxes{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
/// Left-handed, X forward, Y right, Z up.
inline constexpr Axes kUnrealAxes{{0, 0, -1}, {1, 0, 0}, {0, 1, 0}};

using Triple = std::array<double, 3>;
/// Index l(l+1)+m, r g b of each.
using NineCoefficients = std::array<Triple, 9>;

struct DirectionalLight {
  Vec3d towards;        ///< Unit, the target's axes.
  Triple irradiance{};  ///< At normal incidence; no channel is negative.
  double angular_radius_rad = 0;
};

struct SplitLight {
  Validity validity = Validity::none;
  std::optional<float> residual;
  NineCoefficients radiance{};  ///< In the basis of harmonics.hpp (all signs positive), in the target's axes.
  std::optional<DirectionalLight> main;

  [[nodiscard]] bool has_estimate() const { return validity == Validity::valid || validity == Validity::stale; }

  template <class T>
  [[nodiscard]] Converted<T> converted(const T& value) const {
    return {value, validity, residual};
  }
};

/// Projects the lighting to nine coefficients. `main`: whether the strongest light is separate.
[[nodiscard]] SplitLight split(const Lighting& lighting, MainLight main, const Axes& axes,
                               const ConversionOptions& options);

/// The strongest light after options.color, in the target's axes; no value if there is none or no channel is positive.
[[nodiscard]] std::optional<DirectionalLight> strongest(const Lighting& lighting, const Axes& axes,
                                                        const ConversionOptions& options);

/// Negates the coefficients of odd m.
[[nodiscard]] NineCoefficients with_condon_shortley_signs(NineCoefficients coefficients);

/// Coefficients of 1, y, z, x, xy, yz, 3z²-1, xz, x²-y² of the normal, whose sum is the irradiance over pi.
[[nodiscard]] NineCoefficients irradiance_over_pi_polynomial(const NineCoefficients& radiance);

}  // namespace lightwell::core
