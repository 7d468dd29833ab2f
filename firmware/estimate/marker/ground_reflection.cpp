#include "estimate/marker/ground_reflection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace lightwell::marker {
namespace {

/// Rings around the body within which hidden parts of the table are taken for as bright as the others.
constexpr int kRings = 6;
/// Of the light that is taken out: its deviation.
constexpr double kReflectionRelativeSigma = 0.2;

struct GroundPatch {
  Vec3d position;
  Rgb radiance;
};

/// Every place of the table's grid, the hidden ones filled.
std::vector<GroundPatch> filled_ground_grid(const GroundPlane& table) {
  const auto [u, v] = tangent_basis(table.normal);
  const Vec3d foot = table.normal * dot(table.point, table.normal);
  const double step = table.step_m;
  double reach = 0;
  for (const GroundSample& s : table.samples) reach = std::max(reach, length(s.position - foot));
  const int across = static_cast<int>(reach / step + 0.5);
  const int edge = 2 * across + 1;
  std::vector<const GroundSample*> at(static_cast<std::size_t>(edge * edge), nullptr);
  std::array<Rgb, kRings> sum{};
  std::array<double, kRings> count{};
  const auto ring_of = [&](double distance) {
    return std::min(kRings - 1, static_cast<int>(distance / (reach + step) * kRings));
  };
  for (const GroundSample& s : table.samples) {
    const Vec3d from = s.position - foot;
    const int column = static_cast<int>(std::lround(dot(from, u) / step)) + across,
              row = static_cast<int>(std::lround(dot(from, v) / step)) + across;
    if (column >= 0 && row >= 0 && column < edge && row < edge) at[static_cast<std::size_t>(row * edge + column)] = &s;
    const auto ring = static_cast<std::size_t>(ring_of(length(from)));
    count[ring] += 1;
    for (std::size_t c = 0; c < 3; ++c) sum[ring][c] += s.color[c];
  }
  std::vector<GroundPatch> out;
  for (int row = 0; row < edge; ++row)
    for (int column = 0; column < edge; ++column) {
      const double x = (column - across) * step, y = (row - across) * step, distance = std::hypot(x, y);
      if (distance > reach + step) continue;
      GroundPatch part{foot + u * x + v * y, {}};
      if (const GroundSample* seen = at[static_cast<std::size_t>(row * edge + column)]) {
        part.radiance = seen->color;
      } else {
        auto ring = static_cast<std::size_t>(ring_of(distance));
        while (ring + 1 < kRings && count[ring] == 0) ++ring;
        if (count[ring] == 0) continue;
        for (std::size_t c = 0; c < 3; ++c) part.radiance[c] = sum[ring][c] / count[ring];
      }
      out.push_back(part);
    }
  return out;
}

}  // namespace

void estimate_ground_reflection(Shading& shading) {
  if (!shading.table || shading.table->samples.empty()) return;
  const GroundPlane& table = *shading.table;
  const std::vector<GroundPatch> parts = filled_ground_grid(table);
  const double area = table.step_m * table.step_m;
  for (SurfaceSample& s : shading.samples) {
    s.from_ground = {};
    for (const GroundPatch& part : parts) {
      const Vec3d way = part.position - s.position;
      const double squared = dot(way, way);
      const double leaves = -dot(way, table.normal), meets = dot(way, s.normal);
      if (!(leaves > 0) || !(meets > 0)) continue;
      // Between two small parts; close by, a part is a disc of its area rather than a point.
      const double factor = leaves * meets / (squared * (squared + area / std::numbers::pi)) * area;
      for (std::size_t c = 0; c < 3; ++c) s.from_ground[c] += part.radiance[c] * factor;
    }
  }
}

void subtract_ground_reflection(Shading& shading) {
  for (SurfaceSample& s : shading.samples) {
    for (std::size_t c = 0; c < 3; ++c) {
      s.irradiance[c] = std::max(0.0, s.irradiance[c] - s.from_ground[c]);
      s.sigma[c] = std::hypot(s.sigma[c], kReflectionRelativeSigma * s.from_ground[c]);
    }
    s.from_ground = {};
  }
}

}  // namespace lightwell::marker
