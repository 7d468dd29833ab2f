#include "field/proxy.hpp"

#include <algorithm>
#include <cmath>

#include "rays/ray_scene.hpp"

namespace lightwell {

bool field_has_geometry() { return true; }

namespace field {

Result<std::shared_ptr<const Proxy>> Proxy::make(const FieldGeometry& geometry) {
  const std::size_t triangles = geometry.indices.size() / 3;
  std::shared_ptr<Proxy> out(new Proxy);
  if (const Status made =
          rays::RayScene::make(geometry.vertices, geometry.indices.first(3 * triangles)).assign_to(out->rays_);
      !made.ok())
    return made;
  const auto corner = [&](std::size_t triangle, std::size_t k) {
    return vec_cast<double>(geometry.vertices[geometry.indices[3 * triangle + k]]);
  };
  const auto edge_of = [&](std::size_t t, double texel) {
    const double longest = std::max({length(corner(t, 1) - corner(t, 0)), length(corner(t, 2) - corner(t, 0)),
                                     length(corner(t, 2) - corner(t, 1))});
    return static_cast<std::uint32_t>(std::clamp(std::ceil(longest / texel), 1.0, 64.0));
  };
  // Larger texels where there would be too many; one each in the end.
  double texel = kTexel_m;
  for (std::size_t total = kMaxTexels + 1; texel < 1e6; texel *= 1.5) {
    total = 0;
    for (std::size_t t = 0; t < triangles; ++t) total += std::size_t{1} * edge_of(t, texel) * edge_of(t, texel);
    if (total <= std::max(kMaxTexels, triangles)) break;
  }
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::uint32_t edge = edge_of(t, texel);
    out->triangles_.push_back({static_cast<std::uint32_t>(out->texels_.size()), edge});
    const Vec3d a = corner(t, 0), ab = corner(t, 1) - a, ac = corner(t, 2) - a;
    for (std::uint32_t row = 0; row < edge; ++row)
      for (std::uint32_t column = 0; column < edge; ++column) {
        double u = (column + 0.5) / edge, v = (row + 0.5) / edge;
        if (const double sum = u + v; sum > 0.95) u *= 0.95 / sum, v *= 0.95 / sum;
        out->texels_.push_back(a + ab * u + ac * v);
      }
  }
  return std::shared_ptr<const Proxy>(std::move(out));
}

bool Proxy::occluded(Vec3d from, Vec3d to, double margin_m) const {
  const Vec3d gap = to - from;
  const double distance = length(gap);
  if (!(distance > 2 * margin_m)) return false;
  const Vec3d direction = gap * (1 / distance);
  return rays_->occluded(vec_cast<float>(from + direction * margin_m), vec_cast<float>(direction),
                         static_cast<float>(distance - 2 * margin_m));
}

std::optional<Vec3d> Proxy::surface_at(Vec3d at, Vec3d from, double reach_m) const {
  const Vec3d gap = at - from;
  const double distance = length(gap);
  if (!(distance > reach_m)) return std::nullopt;
  const auto hit = rays_->first_hit(vec_cast<float>(from), vec_cast<float>(gap * (1 / distance)));
  if (!hit || std::abs(static_cast<double>(hit->distance) - distance) > reach_m) return std::nullopt;
  return vec_cast<double>(hit->normal);
}

void Proxy::first_texels(Vec3d origin, std::span<const Vec3f> directions, std::span<std::uint32_t> out) const {
  constexpr std::size_t kLanes = rays::RayScene::kLanes;
  rays::RayScene::Hits hits;
  for (std::size_t first = 0; first + kLanes <= directions.size(); first += kLanes) {
    rays_->first_hits(vec_cast<float>(origin), directions.subspan(first).first<kLanes>(), hits);
    for (std::size_t k = 0; k < kLanes; ++k) {
      out[first + k] = kNoTexel;
      if (hits.triangle[k] == rays::RayScene::kNoTriangle) continue;
      const Triangle& triangle = triangles_[hits.triangle[k]];
      const auto cell = [&](float barycentric) {
        const float scaled = std::max(barycentric, 0.0F) * static_cast<float>(triangle.edge);
        return std::min(static_cast<std::uint32_t>(scaled), triangle.edge - 1);
      };
      out[first + k] = triangle.first + cell(hits.v[k]) * triangle.edge + cell(hits.u[k]);
    }
  }
}

}  // namespace field
}  // namespace lightwell
