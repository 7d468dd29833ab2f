#include "core/light_samples.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lightwell::core {
namespace {

/// Lower directions would project to infinity; the plane receives 1e-8 of their light at most.
constexpr double kMinCosine = 1e-4;

/// Candidates by which the share of a cap above the horizon is estimated.
constexpr int kTrial = 256;
/// Most candidates of a cap of which nearly all is below the horizon.
constexpr int kMaxCandidates = 1 << 14;

Vec3d on_hemisphere(DiscPoint p) { return {p.x, p.y, std::sqrt(std::max(0.0, 1 - p.x * p.x - p.y * p.y))}; }

/// The centroid of disc_point().
DiscPoint centroid(int count) {
  DiscPoint sum;
  for (int i = 0; i < count; ++i) {
    const DiscPoint p = disc_point(i, count);
    sum.x += p.x / count;
    sum.y += p.y / count;
  }
  return sum;
}

/// Calls `use(direction)` for directions of equal solid angle that are above the horizon. Without the offset of the
/// spiral's centroid, 0.5 / count, by which every penumbra would be shifted.
template <class Use>
void each_above(Vec3d axis, double radius_rad, int candidates, const Use& use) {
  const auto [u, v] = tangent_basis(axis);
  // Archimedes: a disc of equal areas maps to the cap by 1 - cos(angle) = (1 - cos(radius)) r².
  const double depth = 1 - std::cos(radius_rad);
  const DiscPoint middle = centroid(candidates);
  for (int i = 0; i < candidates; ++i) {
    const DiscPoint q = disc_point(i, candidates), p{q.x - middle.x, q.y - middle.y};
    const double r2 = p.x * p.x + p.y * p.y, below = depth * r2;
    // sin(angle) / r
    const double s = std::sqrt(depth * std::max(0.0, 2 - below));
    const Vec3d d = axis * (1 - below) + u * (s * p.x) + v * (s * p.y);
    if (d.z > kMinCosine) use(d);
  }
}

}  // namespace

DiscPoint disc_point(int i, int count) {
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  // A single point is the centre.
  const double r = count > 1 ? std::sqrt((i + 0.5) / count) : 0, angle = golden_angle * i;
  return {r * std::cos(angle), r * std::sin(angle)};
}

void sample_cap(Vec3d axis, double radius_rad, int count, std::vector<LightSample>& samples) {
  samples.clear();
  if (!(radius_rad > 0)) count = 1;
  int candidates = count;
  if (axis.z < std::sin(radius_rad) + kMinCosine && count > 1) {
    int above = 0;
    each_above(axis, radius_rad, kTrial, [&](Vec3d) { ++above; });
    candidates = above == 0 ? kMaxCandidates : std::min(kMaxCandidates, count * kTrial / above);
  }
  double sum = 0;
  each_above(axis, radius_rad, candidates, [&](Vec3d d) {
    samples.push_back({d, d.z});
    sum += d.z;
  });
  for (LightSample& s : samples) s.weight /= sum;
}

void sample_near_light(Vec3d centre, double radius_m, Vec3d target, int count, std::vector<LightSample>& samples) {
  samples.clear();
  if (!(radius_m > 0)) count = 1;
  const auto [u, v] = tangent_basis(normalized(centre - target));
  const DiscPoint middle = centroid(count);
  for (int i = 0; i < count; ++i) {
    const DiscPoint p = disc_point(i, count);
    const Vec3d position = centre + u * (radius_m * (p.x - middle.x)) + v * (radius_m * (p.y - middle.y));
    if (position.z > 0) samples.push_back({position, 1});
  }
  for (LightSample& s : samples) s.weight /= static_cast<double>(samples.size());
}

HemisphereSampler::HemisphereSampler(int directions) {
  // Nusselt's analogue: equal areas of the unit disc are equal irradiances from the hemisphere above.
  std::vector<DiscPoint> centres;
  for (int i = 0; i < directions; ++i) {
    centres.push_back(disc_point(i, directions));
    samples_.push_back({on_hemisphere(centres.back()), {}});
  }
  const int probes = kPerCell * directions;
  for (int i = 0; i < probes; ++i) {
    const DiscPoint p = disc_point(i, probes);
    const auto nearest = std::ranges::min_element(
        centres, {}, [&](DiscPoint c) { return (c.x - p.x) * (c.x - p.x) + (c.y - p.y) * (c.y - p.y); });
    probes_.push_back({on_hemisphere(p), static_cast<std::uint32_t>(nearest - centres.begin())});
  }
}

std::span<const HemisphereSample> HemisphereSampler::sample(const std::function<Radiance(Vec3d)>& radiance) {
  for (HemisphereSample& s : samples_) s.irradiance = {};
  const float area = std::numbers::pi_v<float> / static_cast<float>(probes_.size());
  for (const Probe& probe : probes_) {
    const Radiance l = radiance(probe.towards);
    samples_[probe.cell].irradiance += Irradiance{l.r * area, l.g * area, l.b * area};
  }
  return samples_;
}

}  // namespace lightwell::core
