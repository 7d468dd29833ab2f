// Irradiance at many normals: the sum of harmonics and caps, a vector of normals at a time.
#pragma once

#include <cstddef>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>

#include "core/receiver_lights.hpp"

namespace lightwell::core {

/// out[i] for normals[i], of any length; as many of each. Within 1e-5 of the largest irradiance of what the one-normal
/// query says. A normal that is zero or not finite gives zero; returns how many there were.
std::size_t irradiance_rows(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights,
                            std::span<const Vec3f> normals, std::span<Irradiance> out);

/// The same of one, as that query has it; false where the normal is zero or not finite.
[[nodiscard]] bool irradiance_one(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights, Vec3f normal,
                                  Irradiance& out);

}  // namespace lightwell::core
