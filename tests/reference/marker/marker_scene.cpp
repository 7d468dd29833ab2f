#include "reference/marker/marker_scene.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "reference/marker/marker_world.hpp"
#include "reference/quadrature.hpp"

namespace lightwell::reference {

namespace {

V3 as_v3(Vec3d v) { return {v.x, v.y, v.z}; }
Vec3d as_vec(const V3& v) { return {v.x, v.y, v.z}; }

}  // namespace

MarkerAmbient even_ambient(const Rgb& radiance) {
  MarkerAmbient out;
  for (std::size_t c = 0; c < 3; ++c) out.sh[0][c] = radiance[c] * std::sqrt(4 * pi);
  return out;
}

MarkerAmbient ambient_from_function(const RadianceFunction& radiance, int rows) {
  MarkerAmbient out;
  const GaussLegendre heights = gauss_legendre(rows);
  for (std::size_t j = 0; j < heights.nodes.size(); ++j) {
    const double y = heights.nodes[j], r = std::sqrt(1 - y * y);
    for (int i = 0; i < 2 * rows; ++i) {
      const double phi = pi * (i + 0.5) / rows;
      const Vec3d d{r * std::sin(phi), y, r * std::cos(phi)};
      out.sky.push_back({d, radiance(as_v3(d)), heights.weights[j] * pi / rows});
    }
  }
  return out;
}

MarkerAmbient ambient_from_panorama(const Panorama& panorama, const Quat& probe_panorama, int block) {
  MarkerAmbient out;
  for (int top = 0; top < panorama.height; top += block)
    for (int left = 0; left < panorama.width; left += block) {
      // A mean direction per channel would be exact; a patch has only one, weighted by luminance.
      Rgb energy{};
      Vec3d towards;
      for (int j = top; j < std::min(top + block, panorama.height); ++j)
        for (int i = left; i < std::min(left + block, panorama.width); ++i) {
          const double solid_angle = pixel_solid_angle(j, panorama.width, panorama.height);
          const Rgb here = pixel(panorama, i, j);
          for (std::size_t c = 0; c < 3; ++c) energy[c] += here[c] * solid_angle;
          towards += as_vec(pixel_direction(i, j, panorama.width, panorama.height)) * (luminance(here) * solid_angle);
        }
      if (!(luminance(energy) > 0)) continue;
      // The vector irradiance of the block, which is smaller than its energy because of its extent.
      const double kept = length(towards) / luminance(energy);
      for (double& value : energy) value *= kept;
      out.sky.push_back({rotate(probe_panorama, normalized(towards)), energy, 1});
    }
  return out;
}

MarkerTable table_under(const MarkerBody& body, const Pose& probe_body, int tag_id, const Rgb& albedo) {
  for (const MarkerFace& face : body.faces)
    if (face.tag_id == tag_id) {
      const Pose at = compose(probe_body, face.body_face);
      MarkerTable out;
      out.point = at.translation;
      out.normal = -rotate(at.rotation, Vec3d{0, 0, 1});
      out.albedo = albedo;
      return out;
    }
  throw std::out_of_range("the body has no face of tag " + std::to_string(tag_id));
}

Rgb Incident::total() const {
  Rgb out = ambient;
  for (const Rgb& lamp : lamps)
    for (std::size_t c = 0; c < 3; ++c) out[c] += lamp[c];
  return out;
}

Incident irradiance_at(const MarkerScene& scene, Vec3d point, Vec3d normal) {
  const MarkerWorld world(scene);
  return world.incident(point, normal, world.ambient(normal), {{}, false, true});
}

Incident face_irradiance(const MarkerScene& scene, std::size_t face, FacePoint point) {
  const MarkerWorld world(scene);
  const WorldPolygon& polygon = world.faces().at(face);
  return world.incident(polygon.place(point), polygon.z, world.face_ambient(face), {{SurfaceKind::face, face}});
}

Incident ball_irradiance(const MarkerScene& scene, Vec3d normal) {
  const MarkerWorld world(scene);
  const Vec3d n = rotate(scene.probe_body.rotation, normal);
  const Vec3d point = world.ball_center() + n * scene.body.ball.value().radius_m;
  return world.incident(point, n, world.ambient(n), {{SurfaceKind::ball, 0}});
}

Incident table_irradiance(const MarkerScene& scene, Vec3d point) {
  const MarkerWorld world(scene);
  return world.incident(point, scene.table.value().normal, world.table_ambient(point), {{SurfaceKind::table, 0}});
}

Rgb patch_radiance(const MarkerScene& scene, std::size_t face, const FaceOutline& outline, const Rgb& albedo,
                   int steps) {
  const MarkerWorld world(scene);
  const WorldPolygon& polygon = world.faces().at(face);
  Rgb sum{};
  double area = 0;
  const auto take = [&](FacePoint p, double weight) {
    const Rgb light =
        world.incident(polygon.place(p), polygon.z, world.face_ambient(face), {{SurfaceKind::face, face}}).total();
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * light[c];
    area += weight;
  };
  for (std::size_t k = 2; k < outline.size(); ++k) {
    const FacePoint &a = outline[0], &b = outline[k - 1], &c = outline[k];
    const double weight = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    const auto at = [&](double s, double t) {
      return FacePoint{a.x + s * (b.x - a.x) + t * (c.x - a.x), a.y + s * (b.y - a.y) + t * (c.y - a.y)};
    };
    // Centroids of steps² congruent triangles, pointing up and, between them, down.
    for (int i = 0; i < steps; ++i)
      for (int j = 0; i + j < steps; ++j) {
        take(at((i + 1.0 / 3) / steps, (j + 1.0 / 3) / steps), weight);
        if (i + j + 1 < steps) take(at((i + 2.0 / 3) / steps, (j + 2.0 / 3) / steps), weight);
      }
  }
  for (std::size_t c = 0; c < 3; ++c) sum[c] *= albedo[c] / (pi * area);
  return sum;
}

Rgb patch_radiance(const MarkerScene& scene, std::size_t face, std::size_t patch, int steps) {
  const MarkerPatch& one = scene.body.faces.at(face).patches.at(patch);
  return patch_radiance(scene, face, one.outline, one.albedo, steps);
}

FacePoint outline_centre(const FaceOutline& outline) {
  FacePoint out;
  double area = 0;
  for (std::size_t k = 2; k < outline.size(); ++k) {
    const FacePoint &a = outline[0], &b = outline[k - 1], &c = outline[k];
    const double weight = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    out.x += weight * (a.x + b.x + c.x) / 3;
    out.y += weight * (a.y + b.y + c.y) / 3;
    area += weight;
  }
  return {out.x / area, out.y / area};
}

std::vector<LampTruth> lamp_truths(const MarkerScene& scene) {
  std::vector<LampTruth> out;
  for (const MarkerLamp& lamp : scene.lamps) {
    LampTruth truth;
    if (const auto* far = std::get_if<DistantLamp>(&lamp)) {
      truth.direction_probe = normalized(far->direction);
      truth.irradiance = far->irradiance;
    } else {
      const auto& near = std::get<NearLamp>(lamp);
      const Vec3d to = near.position - scene.probe_body.translation;
      truth.distance_m = length(to);
      truth.direction_probe = normalized(to);
      for (std::size_t c = 0; c < 3; ++c) truth.irradiance[c] = near.intensity[c] / dot(to, to);
    }
    truth.direction_body = rotate(scene.probe_body.rotation.inverse(), truth.direction_probe);
    out.push_back(truth);
  }
  return out;
}

}  // namespace lightwell::reference
