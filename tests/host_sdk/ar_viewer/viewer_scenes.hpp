// Scenes for tests of ar_viewer, and pictures of them by software OpenGL.
#pragma once

#include <functional>
#include <string>

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>

#include "ar_viewer/picture.hpp"
#include "ar_viewer/scene.hpp"
#include "ar_viewer/viewer.hpp"

namespace lightwell::test {

/// 640x360, black background; the camera looks down at the origin from 0.5 m. Without light.
[[nodiscard]] viewer::Scene make_viewer_scene();
/// The scene in the light of the descriptor, whose axes are those of the world.
void set_light(viewer::Scene& scene, Descriptor descriptor);
/// One object of that shape.
[[nodiscard]] viewer::Object make_object(const std::string& mesh, std::vector<double> size_m, Vec3d position = {});

/// A descriptor of uniform radiance.
[[nodiscard]] Descriptor uniform_light(Radiance radiance);
/// A light; irradiance at normal incidence.
[[nodiscard]] Light make_light(Vec3f direction, Irradiance irradiance, double radius_deg, float distance_m = 0);

/// A frame, and the factor of the ground.
struct Rendered {
  viewer::Picture frame, shadow;
};
/// The first frame. Fails the test, and returns empty pictures, where it cannot be drawn.
[[nodiscard]] Rendered render(const viewer::Scene& scene);

/// The ray through the centre of a pixel, in the world; unit.
[[nodiscard]] Vec3d ray_of(const viewer::Scene& scene, double column, double row);
[[nodiscard]] Vec3d eye_of(const viewer::Scene& scene);
/// Where the ray meets the plane y = 0.
[[nodiscard]] Vec3d ground_point(const viewer::Scene& scene, double column, double row);
/// The point of the world in pixels.
struct PixelPoint {
  double column = 0, row = 0;
};
[[nodiscard]] PixelPoint pixel_of(const viewer::Scene& scene, Vec3d point);

/// Calls visit(column, row, point, normal) for the pixels whose centre shows the sphere, those at its rim within
/// `margin` of its radius left out.
void for_sphere_pixels(const viewer::Scene& scene, Vec3d centre, double radius, double margin,
                       const std::function<void(int, int, Vec3d, Vec3d)>& visit);

}  // namespace lightwell::test
