// Sphere, box, cylinder, cloth.
#include <cmath>
#include <numbers>

#include "ar_viewer/mesh.hpp"

namespace lightwell::viewer {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Adds a grid of (rows + 1) x (columns + 1) vertices; at(s, t), both 0 to 1, makes one. Its outside is along
/// d/ds x d/dt.
template <class At>
void add_grid(Mesh& mesh, int rows, int columns, const At& at) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c)
      mesh.vertices.push_back(
          at(static_cast<float>(c) / static_cast<float>(columns), static_cast<float>(r) / static_cast<float>(rows)));
  const auto width = static_cast<std::uint32_t>(columns) + 1;
  for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(rows); ++r)
    for (std::uint32_t c = 0; c < static_cast<std::uint32_t>(columns); ++c) {
      const std::uint32_t a = first + r * width + c, b = a + 1, d = a + width, e = d + 1;
      mesh.indices.insert(mesh.indices.end(), {a, b, e, a, e, d});
    }
}

}  // namespace

Mesh make_sphere(int rings, int segments) {
  Mesh mesh;
  add_grid(mesh, rings, segments, [](float s, float t) {
    const float phi = 2 * kPi * s, theta = kPi * (t - 0.5F);
    const Vec3f n{std::cos(theta) * std::sin(phi), std::sin(theta), std::cos(theta) * std::cos(phi)};
    return Vertex{n * 0.5F, n, {s, 1 - t}, {std::cos(phi), 0, -std::sin(phi), 1}};
  });
  return mesh;
}

Mesh make_box() {
  Mesh mesh;
  const auto face = [&mesh](Vec3f n, Vec3f u) {
    const Vec3f v = cross(n, u);
    add_grid(mesh, 1, 1, [&](float s, float t) {
      return Vertex{(n + u * (2 * s - 1) + v * (2 * t - 1)) * 0.5F, n, {s, 1 - t}, {u.x, u.y, u.z, 1}};
    });
  };
  face({0, 0, 1}, {1, 0, 0});
  face({0, 0, -1}, {-1, 0, 0});
  face({1, 0, 0}, {0, 0, -1});
  face({-1, 0, 0}, {0, 0, 1});
  face({0, 1, 0}, {1, 0, 0});
  face({0, -1, 0}, {1, 0, 0});
  return mesh;
}

Mesh make_cylinder(int segments) {
  Mesh mesh;
  add_grid(mesh, 1, segments, [](float s, float t) {
    const Vec3f n{std::sin(2 * kPi * s), 0, std::cos(2 * kPi * s)};
    return Vertex{{n.x * 0.5F, t - 0.5F, n.z * 0.5F}, n, {s, 1 - t}, {n.z, 0, -n.x, 1}};
  });
  for (const float side : {1.0F, -1.0F})
    add_grid(mesh, 1, segments, [side](float s, float t) {
      const float radius = 0.5F * (1 - t), phi = side * 2 * kPi * s;
      const Vec3f p{radius * std::sin(phi), 0.5F * side, radius * std::cos(phi)};
      return Vertex{p, {0, side, 0}, {0.5F + p.x, 0.5F + p.z}, {1, 0, 0, -side}};
    });
  return mesh;
}

Mesh make_cloth(int n) {
  // The profile in x, y: flat, half circle to the left's layer, flat, half circle, flat.
  constexpr float kFlat = 0.8F, kRadius = 0.07F, kBend = kPi * kRadius, kWhole = 3 * kFlat + 2 * kBend;
  const auto profile = [](float s) {
    float along = s * kWhole;
    if (along < kFlat) return Vec3f{along - kFlat / 2, 0, 0};
    along -= kFlat;
    if (along < kBend)
      return Vec3f{kFlat / 2 + kRadius * std::sin(along / kRadius), kRadius - kRadius * std::cos(along / kRadius), 0};
    along -= kBend;
    if (along < kFlat) return Vec3f{kFlat / 2 - along, 2 * kRadius, 0};
    along -= kFlat;
    if (along < kBend)
      return Vec3f{-kFlat / 2 - kRadius * std::sin(along / kRadius), 3 * kRadius - kRadius * std::cos(along / kRadius),
                   0};
    along -= kBend;
    return Vec3f{-kFlat / 2 + along, 4 * kRadius, 0};
  };
  Mesh mesh;
  add_grid(mesh, n, 2 * n, [&](float s, float t) {
    Vec3f p = profile(s);
    const float z = t - 0.5F, height = p.y / (4 * kRadius);
    p.z = 0.7F * z;
    p.x += 0.02F * std::sin(7 * z) * height;
    p.y += 0.012F * std::sin(9 * p.x + 5 * z);
    p.y += 0.03F * height * std::sin(9 * z + 4 * p.x) + 0.02F * height * std::cos(5 * p.x - 3 * z);
    return Vertex{p, {}, {3 * s, t}};
  });
  compute_normals(mesh);
  compute_tangents(mesh);
  return mesh;
}

}  // namespace lightwell::viewer
