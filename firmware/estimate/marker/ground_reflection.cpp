#include "estimate/marker/ground_reflection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace lightwell::marker {
namespace {

/// Number of rings around the body; hidden patches get the mean radiance of their ring.
constexpr int kRings = 6;
/// Standard deviation of the subtracted irradiance, relative to it.
constexpr double kReflectionRelativeSigma = 0.2;

struct GroundPatch {
  Vec3d position;
  Rgb radiance;
};

/// All patches of the ground plane's grid, hidden ones filled in.
std::vector<GroundPatch> fill_ground_grid(const GroundPlane& ground) {
  const auto [u, v] = tangent_basis(ground.normal);
  const Vec3d below_body = ground.normal * dot(ground.point, ground.normal);
  const double step = ground.step_m;
  double reach = 0;
  for (const GroundSample& s : ground.samples) reach = std::max(reach, length(s.position - below_body));
  const int across = static_cast<int>(reach / step + 0.5);
  const int edge = 2 * across + 1;
  std::vector<const GroundSample*> at(static_cast<std::size_t>(edge * edge), nullptr);
  std::array<Rgb, kRings> sum{};
  std::array<double, kRings> count{};
  const auto ring_of = [&](double distance) {
    return std::min(kRings - 1, static_cast<int>(distance / (reach + step) * kRings));
  };
  for (const GroundSample& s : ground.samples) {
    const Vec3d from = s.position - below_body;
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
      GroundPatch patch{below_body + u * x + v * y, {}};
      if (const GroundSample* observed = at[static_cast<std::size_t>(row * edge + column)]) {
        patch.radiance = observed->color;
      } else {
        auto ring = static_cast<std::size_t>(ring_of(distance));
        while (ring + 1 < kRings && count[ring] == 0) ++ring;
        if (count[ring] == 0) continue;
        for (std::size_t c = 0; c < 3; ++c) patch.radiance[c] = sum[ring][c] / count[ring];
      }
      out.push_back(patch);
    }
  return out;
}

}  // namespace

void estimate_ground_reflection(Shading& shading) {
  if (!shading.ground || shading.ground->samples.empty()) return;
  const GroundPlane& ground = *shading.ground;
  const std::vector<GroundPatch> patches = fill_ground_grid(ground);
  const double area = ground.step_m * ground.step_m;
  for (SurfaceSample& s : shading.samples) {
    s.from_ground = {};
    for (const GroundPatch& patch : patches) {
      const Vec3d to_patch = patch.position - s.position;
      const double squared = dot(to_patch, to_patch);
      const double along_ground_normal = -dot(to_patch, ground.normal), along_sample_normal = dot(to_patch, s.normal);
      if (!(along_ground_normal > 0) || !(along_sample_normal > 0)) continue;
      // Form factor from a small surface to a disc of the patch's area (Cohen & Wallace 1993, "Radiosity and realistic
      // image synthesis"): finite at small distances.
      const double factor =
          along_ground_normal * along_sample_normal / (squared * (squared + area / std::numbers::pi)) * area;
      for (std::size_t c = 0; c < 3; ++c) s.from_ground[c] += patch.radiance[c] * factor;
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
