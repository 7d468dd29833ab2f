// Irradiance of harmonics and caps at many normals (SIMD).
#pragma once

#include <cstddef>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

#include "core/receiver_lights.hpp"

namespace lightwell::core {

/// out[i] for normals[i]; both spans have the same size, normals any length. Differs from irradiance_one() by at most
/// 1e-5 of the largest irradiance. A normal that is zero or not finite gives zero; returns the number of these.
std::size_t irradiance_rows(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights,
                            std::span<const Vec3f> normals, std::span<Irradiance> out);

/// The irradiance at a single normal; false if it is zero or not finite.
[[nodiscard]] bool irradiance_one(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights, Vec3f normal,
                                  Irradiance& out);

}  // namespace lightwell::core
