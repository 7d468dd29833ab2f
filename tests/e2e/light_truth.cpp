#include "e2e/light_truth.hpp"

namespace lightwell::test {
namespace {

constexpr int kNormals = 2048;
/// Each pixel of the panorama is subdivided to this many columns in total, for bilinear interpolation.
constexpr int kWidth = 384;

reference::Panorama refined(const PanoramaPixels& pixels) {
  const reference::Panorama coarse{pixels.width, pixels.height, {pixels.rgb.begin(), pixels.rgb.end()}};
  const reference::M3 still = {reference::V3{1, 0, 0}, reference::V3{0, 1, 0}, reference::V3{0, 0, 1}};
  return reference::turned(coarse, still, kWidth, kWidth / 2, 2);
}

}  // namespace

LightTruth::LightTruth(const PanoramaPixels& pixels)
    : normals_(reference::fibonacci_normals(kNormals)), truth_(reference::irradiance_at(refined(pixels), normals_)) {}

reference::IrradianceError LightTruth::error_of(const Lighting& lighting) const {
  std::vector<reference::Rgb> estimate;
  for (const reference::V3& n : normals_) {
    const Vec3f normal{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
    const Irradiance e = lighting.irradiance(normal).value;
    estimate.push_back({e.r, e.g, e.b});
  }
  return reference::irradiance_error(truth_, estimate);
}

std::optional<Light> light_near(const Descriptor& descriptor, Vec3d direction, double reach_rad) {
  std::optional<Light> nearest;
  double least = reach_rad;
  for (const Light& light : descriptor.lights) {
    const double angle = angle_between(vec_cast<double>(light.direction), direction);
    if (angle > least) continue;
    least = angle;
    nearest = light;
  }
  return nearest;
}

}  // namespace lightwell::test
