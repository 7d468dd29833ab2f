#include <lightwell/query.hpp>

namespace lightwell {

Irradiance lights_irradiance(std::span<const Light> lights, Vec3f normal) {
  Irradiance sum;
  for (const Light& light : lights) {
    const double c = dot(vec_cast<double>(light.direction), vec_cast<double>(normal));
    sum += light.irradiance * static_cast<float>(cap_irradiance(c, light.angular_radius_rad));
  }
  return sum;
}

Radiance lights_radiance(std::span<const Light> lights, Vec3f direction, const GgxLobe& lobe) {
  Radiance sum;
  for (const Light& light : lights) {
    const double c = dot(vec_cast<double>(light.direction), vec_cast<double>(direction));
    const auto k = static_cast<float>(cap_radiance(c, light.angular_radius_rad, lobe));
    sum += {light.irradiance.r * k, light.irradiance.g * k, light.irradiance.b * k};
  }
  return sum;
}

Irradiance irradiance_at(const Descriptor& descriptor, Vec3f normal) {
  return evaluate(irradiance_of(descriptor.radiance), normal) + lights_irradiance(descriptor.lights, normal);
}

}  // namespace lightwell
