#include "field/triangulate.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::field {
namespace {

constexpr double kNearest_m = 0.15;
constexpr int kIterations = 4;  // The weights depend on the distances.

void add_scaled(Symmetric3& out, const Symmetric3& m, double s) {
  for (std::size_t i = 0; i < 6; ++i) out[i] += s * m[i];
}

Symmetric3 outer(Vec3d d) { return {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z}; }

}  // namespace

double quadratic(const Symmetric3& m, Vec3d a, Vec3d b) { return dot(a, product(m, b)); }

Vec3d product(const Symmetric3& m, Vec3d v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[1] * v.x + m[3] * v.y + m[4] * v.z,
          m[2] * v.x + m[4] * v.y + m[5] * v.z};
}

Symmetric3 inverted(const Symmetric3& m) {
  const auto& [a, b, c, d, e, f] = m;
  const double A = d * f - e * e, B = c * e - b * f, C = b * e - c * d;
  const double det = a * A + b * B + c * C;
  if (!(std::abs(det) > 1e-300)) return {};
  const double k = 1 / det;
  return {A * k, B * k, C * k, (a * f - c * c) * k, (b * c - a * e) * k, (a * d - b * b) * k};
}

std::optional<Triangulation> triangulate(std::span<const Observation> observations,
                                         std::span<const std::size_t> chosen) {
  Triangulation out;
  bool first = true;
  for (int iteration = 0; iteration < kIterations; ++iteration, first = false) {
    Symmetric3 information{};
    Vec3d right{};
    for (const std::size_t i : chosen) {
      const Observation& o = observations[i];
      const double along = first ? 1 : std::max(dot(out.point - o.origin, o.direction), kNearest_m);
      Symmetric3 m{1, 0, 0, 1, 0, 1};
      add_scaled(m, outer(o.direction), -1);
      const double weight = 1 / (o.sigma_rad * o.sigma_rad * along * along);
      add_scaled(information, m, weight);
      right += product(m, o.origin) * weight;
      if (o.distance_m > 0) {
        const Symmetric3 along_ray = outer(o.direction);
        const double w = 1 / std::max(o.distance_sigma_m * o.distance_sigma_m, 1e-8);
        add_scaled(information, along_ray, w);
        right += product(along_ray, o.origin + o.direction * o.distance_m) * w;
      }
    }
    out.covariance = inverted(information);
    if (out.covariance == Symmetric3{}) return std::nullopt;
    out.point = product(out.covariance, right);
    if (!is_finite(out.point)) return std::nullopt;
  }
  for (const std::size_t i : chosen)
    if (!(dot(out.point - observations[i].origin, observations[i].direction) > kNearest_m)) return std::nullopt;
  return out;
}

}  // namespace lightwell::field
