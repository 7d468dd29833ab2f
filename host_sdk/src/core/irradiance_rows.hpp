// Irradiance of harmonics and caps, at one normal and at many (SIMD).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell::core {

/// A light prepared for queries: all that does not depend on the normal is computed once.
struct ReceiverLight {
  Vec3d direction;  ///< Unit; double, to resolve narrow caps at the horizon.
  /// Sine of the radius. If |cos(angle to the normal)| exceeds it, the horizon does not intersect the cap.
  double sin_radius = 0;
  double radius_rad = 0;
  Irradiance irradiance;  ///< At normal incidence.
};

/// Lights with an invalid direction are omitted; they contribute nothing.
[[nodiscard]] std::vector<ReceiverLight> receiver_lights(std::span<const Light> lights);

/// Irradiance of a receiver with the unit normal `normal`: the sum over the lights of their irradiance at normal
/// incidence times the ratio cap_irradiance(), which clips the cap at the receiver's horizon. As irradiance_at().
[[nodiscard]] Irradiance irradiance_on(std::span<const ReceiverLight> lights, Vec3d normal);

/// out[i] for normals[i]; both spans have the same size, normals any length. Differs from irradiance_one() by at most
/// 1e-5 of the largest irradiance. A normal that is zero or not finite gives zero; returns the number of these.
std::size_t irradiance_rows(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights,
                            std::span<const Vec3f> normals, std::span<Irradiance> out);

/// The irradiance at a single normal; false if it is zero or not finite.
[[nodiscard]] bool irradiance_one(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights, Vec3f normal,
                                  Irradiance& out);

}  // namespace lightwell::core
