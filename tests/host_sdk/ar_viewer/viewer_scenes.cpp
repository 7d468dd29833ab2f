#include "host_sdk/ar_viewer/viewer_scenes.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "ar_viewer/headless_context.hpp"

namespace lightwell::test {

viewer::Scene make_viewer_scene() {
  viewer::Scene scene;
  const double tilt = std::atan2(0.3, 0.4);
  scene.pose = Pose{Quat::about({1, 0, 0}, -tilt), {0, 0.3, 0.4}};
  scene.T_world_probe = Pose{};
  scene.camera.fx = scene.camera.fy = 600;
  return scene;
}

void set_light(viewer::Scene& scene, Descriptor descriptor) {
  scene.lights["light"] = viewer::LightValues{std::move(descriptor)};
}

viewer::Object make_object(const std::string& mesh, std::vector<double> size_m, Vec3d position) {
  viewer::Object object;
  object.mesh = mesh;
  object.size_m = std::move(size_m);
  object.T_anchor_object.translation = position;
  object.material_given = true;
  return object;
}

Descriptor uniform_light(Radiance radiance) {
  Descriptor d;
  d.radiance.c[0] = radiance * static_cast<float>(2 * std::sqrt(std::numbers::pi));
  d.coverage = 1;
  return d;
}

Light make_light(Vec3f direction, Irradiance irradiance, double radius_deg, float distance_m) {
  Light light;
  light.direction = normalized(direction);
  light.irradiance = irradiance;
  light.angular_radius_rad = static_cast<float>(radius_deg * std::numbers::pi / 180);
  light.distance_m = distance_m;
  light.distance_sigma_m = 0.01F * distance_m;
  return light;
}

Rendered render(const viewer::Scene& scene) {
  Rendered out;
  const auto context = viewer::HeadlessContext::make();
  if (!context.ok()) {
    ADD_FAILURE() << context.status().message();
    return out;
  }
  auto made = viewer::Viewer::make(scene);
  if (!made.ok()) {
    ADD_FAILURE() << made.status().message();
    return out;
  }
  const auto report = made->draw_next();
  EXPECT_TRUE(report.ok()) << report.status().message();
  made->renderer().target().read(out.frame);
  EXPECT_TRUE(made->draw_shadow().ok());
  made->renderer().target().read(out.shadow);
  return out;
}

Vec3d eye_of(const viewer::Scene& scene) { return std::get<Pose>(scene.pose).translation; }

Vec3d ray_of(const viewer::Scene& scene, double column, double row) {
  const viewer::CameraModel& c = scene.camera;
  const Vec3d in_camera{(column - c.cx) / c.fx, -(row - c.cy) / c.fy, -1};
  return normalized(rotate(std::get<Pose>(scene.pose).rotation, in_camera));
}

Vec3d ground_point(const viewer::Scene& scene, double column, double row) {
  const Vec3d eye = eye_of(scene), ray = ray_of(scene, column, row);
  return eye + ray * (-eye.y / ray.y);
}

PixelPoint pixel_of(const viewer::Scene& scene, Vec3d point) {
  const viewer::CameraModel& c = scene.camera;
  const Vec3d p = transformed(inverse(std::get<Pose>(scene.pose)), point);
  return {c.cx - c.fx * p.x / p.z, c.cy + c.fy * p.y / p.z};
}

void for_sphere_pixels(const viewer::Scene& scene, Vec3d centre, double radius, double margin,
                       const std::function<void(int, int, Vec3d, Vec3d)>& visit) {
  const Vec3d eye = eye_of(scene);
  for (int row = 0; row < scene.camera.height; ++row)
    for (int column = 0; column < scene.camera.width; ++column) {
      const Vec3d ray = ray_of(scene, column, row), to_centre = centre - eye;
      const double along = dot(ray, to_centre);
      const double beside2 = dot(to_centre, to_centre) - along * along;
      const double limit = radius * (1 - margin);
      if (beside2 > limit * limit) continue;
      const Vec3d point = eye + ray * (along - std::sqrt(radius * radius - beside2));
      visit(column, row, point, normalized(point - centre));
    }
}

}  // namespace lightwell::test
