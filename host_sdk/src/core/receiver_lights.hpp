// Lights prepared for irradiance queries: all that does not depend on the normal is computed once.
#pragma once

#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::core {

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

}  // namespace lightwell::core
