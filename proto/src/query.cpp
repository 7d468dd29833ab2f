#include <lightwell/query.hpp>

namespace lightwell {
namespace {

/// In double, because near 1 a float's cosine cannot resolve angles inside of a narrow lobe or the sun's disc.
double cos_between(Vec3f a, Vec3f b) { return dot(normalized(vec_cast<double>(a)), normalized(vec_cast<double>(b))); }

}  // namespace

Irradiance lights_irradiance(std::span<const Light> lights, Vec3f normal) {
  Irradiance sum;
  for (const Light& light : lights) {
    const double c = cos_between(light.direction, normal);
    sum += light.irradiance * static_cast<float>(cap_irradiance(c, light.angular_radius_rad));
  }
  return sum;
}

Radiance lights_radiance(std::span<const Light> lights, Vec3f direction, const GgxLobe& lobe) {
  Radiance sum;
  for (const Light& light : lights) {
    const double c = cos_between(light.direction, direction);
    const auto k = static_cast<float>(cap_radiance(c, light.angular_radius_rad, lobe));
    sum += {light.irradiance.r * k, light.irradiance.g * k, light.irradiance.b * k};
  }
  return sum;
}

Irradiance irradiance_at(const Descriptor& descriptor, Vec3f normal) {
  return evaluate(irradiance_of(descriptor.radiance), normal) + lights_irradiance(descriptor.lights, normal);
}

}  // namespace lightwell
