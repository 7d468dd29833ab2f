// Lights as receivers of irradiance ask for them: what does not depend on the normal is worked out once.
#pragma once

#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::core {

struct ReceiverLight {
  Vec3d direction;  ///< Of length one: in double, a narrow cap at the horizon is still told apart.
  double sin_radius =
      0;  ///< The cap is whole above a horizon, or below it, where its middle is further away than this.
  double radius_rad = 0;
  Irradiance irradiance;
};

/// Lights whose direction is no direction are left out: no receiver gets any of them.
[[nodiscard]] std::vector<ReceiverLight> receiver_lights(std::span<const Light> lights);

/// The sum over the lights of their irradiance times cap_irradiance(), each clipped at the horizon of the unit vector
/// `normal`; as lights_irradiance().
[[nodiscard]] Irradiance irradiance_on(std::span<const ReceiverLight> lights, Vec3d normal);

}  // namespace lightwell::core
