#include "report/virtual_balls.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "reference/shadow_tracer.hpp"

namespace lightwell::hil {
namespace {

constexpr float kMatte = 0.8F, kMetal = 0.9F;  ///< Albedo, reflectance.
constexpr int kRings = 32, kSegments = 64;     ///< Of a ball's mesh.

/// Distance along the ray, infinity if it misses.
double distance_to(const VirtualBall& ball, Vec3d origin, Vec3d direction) {
  const Vec3d m = ball.centre - origin;
  const double b = dot(m, direction), h = b * b - dot(m, m) + ball.radius_m * ball.radius_m;
  return h >= 0 && b > 0 ? b - std::sqrt(h) : std::numeric_limits<double>::infinity();
}

}  // namespace

LightRatio ShadowTexture::at(double x, double y) const {
  const int i = static_cast<int>(std::floor((x / side_m + 0.5) * edge));
  const int j = static_cast<int>(std::floor((0.5 - y / side_m) * edge));
  if (i < 0 || j < 0 || i >= edge || j >= edge) return {1, 1, 1};
  return ratios[static_cast<std::size_t>(j) * static_cast<std::size_t>(edge) + static_cast<std::size_t>(i)];
}

Result<ShadowTexture> cast_shadows(const Lighting& in_plane, std::span<const VirtualBall> balls, double side_m,
                                   int edge) {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> indices;
  for (const VirtualBall& ball : balls) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    const reference::TriangleMesh mesh =
        reference::make_blob({ball.centre.x, ball.centre.y, ball.centre.z}, ball.radius_m, 0, kRings, kSegments);
    for (const reference::V3& p : mesh.positions) positions.push_back(vec_cast<float>(Vec3d{p.x, p.y, p.z}));
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t vertex : triangle) indices.push_back(first + vertex);
  }
  Result<ShadowCaster> caster = ShadowCaster::make();
  if (!caster) return caster.status();
  ShadowTexture out{side_m, edge,
                    std::vector<LightRatio>(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge))};
  const auto cast = caster->cast(in_plane, {{}, side_m, side_m, edge, edge}, {positions, indices, {}}, out.ratios);
  if (!cast) return cast.status();
  return out;
}

LinearPicture draw_balls(const PlaneCamera& camera, const LinearPicture& real, const LinearPicture& diffuse,
                         std::span<const VirtualBall> balls, const LightFunctions& light,
                         const ShadowTexture& shadows) {
  LinearPicture out(real.width, real.height);
  const Vec3d eye = camera.T_plane_camera.translation;
  const auto sample = [&](int column, int row, std::size_t at) -> Radiance {
    const Vec3d ray = normalized(rotate(camera.T_plane_camera.rotation,
                                        Vec3d{(column - camera.cx) / camera.fx, (camera.cy - row) / camera.fy, -1}));
    const VirtualBall* nearest = nullptr;
    double distance = std::numeric_limits<double>::infinity();
    for (const VirtualBall& ball : balls)
      if (const double d = distance_to(ball, eye, ray); d < distance) distance = d, nearest = &ball;
    if (nearest != nullptr) {
      const Vec3d normal = normalized(eye + ray * distance - nearest->centre);
      if (nearest->glossy) return light.radiance(ray - normal * (2 * dot(ray, normal)), kBallRoughness) * kMetal;
      const Irradiance e = light.irradiance(normal);
      return reflected_radiance({std::max(0.0F, e.r), std::max(0.0F, e.g), std::max(0.0F, e.b)},
                                {kMatte, kMatte, kMatte});
    }
    if (!(ray.z < 0)) return real.pixels[at];
    const Vec3d p = eye - ray * (eye.z / ray.z);
    const LightRatio ratio = shadows.at(p.x, p.y);
    const Radiance &l = real.pixels[at], d = diffuse.pixels[at] * diffuse.alpha[at];
    return {l.r - d.r * (1 - ratio.r), l.g - d.g * (1 - ratio.g), l.b - d.b * (1 - ratio.b)};
  };
  for (int row = 0; row < out.height; ++row)
    for (int column = 0; column < out.width; ++column) {
      const std::size_t at = out.at(column, row);
      for (const int k : {0, 1, 2, 3}) out.pixels[at] += sample(2 * column + k % 2, 2 * row + k / 2, at) * 0.25F;
      out.alpha[at] = 1;
    }
  return out;
}

}  // namespace lightwell::hil
