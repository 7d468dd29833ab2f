#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <lightwell/plane_guidance.hpp>

namespace lightwell {
namespace {

constexpr std::uint32_t kNoSeed = std::numeric_limits<std::uint32_t>::max();

/// Nodes at the other ends of the edges at a node of the lattice.
struct Neighbours {
  std::array<std::uint32_t, 6> node{};
  std::size_t count = 0;

  Neighbours(const HemisphereGrid& grid, std::size_t of) {
    const int level = grid.level_of(of);
    const auto at = static_cast<int>(of - HemisphereGrid::first_of(level));
    if (level == 0) {
      for (int k = 0; k < 4; ++k) add(1, k);
      return;
    }
    add(level, at - 1);
    add(level, at + 1);
    // On a level, each quarter begins at one of its multiples; node `along` of quarter q is q level + along.
    const int quarter = at / level, along = at % level;
    if (level < grid.levels()) {
      const int below = quarter * (level + 1) + along;
      add(level + 1, below);
      add(level + 1, below + 1);
      if (along == 0) add(level + 1, below - 1);
    }
    const int above = quarter * (level - 1) + along;
    add(level - 1, above);
    if (along != 0) add(level - 1, above - 1);
  }

 private:
  void add(int level, int at) {
    const int nodes = HemisphereGrid::nodes_of(level);
    node[count++] =
        static_cast<std::uint32_t>(HemisphereGrid::first_of(level)) + static_cast<std::uint32_t>((at + nodes) % nodes);
  }
};

/// For each node the nearest seen one, propagated from node to node; kNoSeed where none was seen.
std::vector<std::uint32_t> nearest_seen(const PlaneCoverage& coverage, const std::vector<Vec3d>& direction) {
  std::vector<std::uint32_t> seed(direction.size(), kNoSeed), queue, next;
  for (std::size_t n = 0; n < direction.size(); ++n)
    if (coverage.seen[n] != 0) {
      seed[n] = static_cast<std::uint32_t>(n);
      queue.push_back(seed[n]);
    }
  // Each pass moves the seeds by one edge. A seed that replaces another is strictly nearer, so it ends.
  while (!queue.empty()) {
    next.clear();
    for (const std::uint32_t from : queue) {
      const Neighbours around(coverage.grid, from);
      for (std::size_t k = 0; k < around.count; ++k) {
        const std::uint32_t to = around.node[k];
        const Vec3d& d = direction[to];
        if (seed[to] != kNoSeed && !(dot(d, direction[seed[from]]) > dot(d, direction[seed[to]]))) continue;
        seed[to] = seed[from];
        next.push_back(to);
      }
    }
    std::swap(queue, next);
  }
  return seed;
}

}  // namespace

PlaneGuidance plane_guidance(const PlaneCoverage& coverage, const PlaneGuidanceOptions& options) {
  PlaneGuidance out;
  out.next = Vec3d{0, 0, 1};
  out.gap_rad = std::numbers::pi;
  const std::size_t size = coverage.grid.size();
  if (coverage.seen.size() != size) return out;
  std::vector<Vec3d> direction(size);
  for (std::size_t n = 0; n < size; ++n) direction[n] = coverage.grid.direction(n);
  const std::vector<std::uint32_t> seed = nearest_seen(coverage, direction);
  // The tolerance keeps nodes on the circle itself, and the pole at an elevation of pi/2.
  const double lowest = std::sin(std::clamp(options.min_elevation_rad, 0.0, std::numbers::pi / 2)) - 1e-9;
  double all = 0, seen = 0;
  std::size_t farthest = size;
  double farthest_rad = 0;
  for (std::size_t n = 0; n < size; ++n) {
    if (direction[n].z < lowest) continue;
    const double angle = coverage.grid.solid_angle(n);
    all += angle;
    if (coverage.seen[n] != 0) {
      seen += angle;
      continue;
    }
    const double gap = seed[n] == kNoSeed ? std::numbers::pi : angle_between(direction[n], direction[seed[n]]);
    if (gap <= farthest_rad) continue;
    farthest_rad = gap;
    farthest = n;
  }
  out.seen = all > 0 ? seen / all : 0;
  out.gap_rad = farthest_rad;
  out.next = farthest < size ? std::optional(direction[farthest]) : std::nullopt;
  if (out.seen >= options.min_seen && out.gap_rad <= options.max_gap_rad) out.progress = CaptureProgress::enough;
  return out;
}

double guidance_disc_radius(const PlaneGuidanceOptions& options) {
  return std::tan((std::numbers::pi / 2 - std::clamp(options.min_elevation_rad, 0.0, std::numbers::pi / 2)) / 2);
}

std::optional<Vec3d> probe_direction(const PlaneInfo& info) {
  if (!info.T_probe_plane) return std::nullopt;
  const Vec3d d = normalized(inverse(*info.T_probe_plane).translation);
  return d.z > 0 ? std::optional(d) : std::nullopt;
}

}  // namespace lightwell
