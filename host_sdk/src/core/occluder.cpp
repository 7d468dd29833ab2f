#include "core/occluder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace lightwell::core {
namespace {

/// Triangles of a block of compute_facing().
constexpr std::size_t kBlock = 64;

bool usable(Vec3f p) {
  // False for NaN.
  const auto within = [](float v) { return std::abs(v) <= Occluder::kMaxCoordinate; };
  return within(p.x) && within(p.y) && within(p.z);
}

/// Where the segment is at that height. The same point for a -> b and b -> a, so that neighbours meet.
Vec3f at_height(Vec3f a, Vec3f b, float height) {
  if (a.z > b.z) std::swap(a, b);
  const float t = (height - a.z) / (b.z - a.z);
  return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), height};
}

/// The part of the segment between heights 0 and `ceiling`. False if there is none.
bool clip_segment(Segment& s, float ceiling) {
  // An edge on the plane closes the outline of a triangle that stands on it.
  if (std::max(s.a.z, s.b.z) < 0 || std::min(s.a.z, s.b.z) > ceiling) return false;
  const Segment whole = s;
  const auto clipped = [&](Vec3f p) {
    if (p.z < 0) return at_height(whole.a, whole.b, 0);
    if (p.z > ceiling) return at_height(whole.a, whole.b, ceiling);
    return p;
  };
  s = {clipped(s.a), clipped(s.b)};
  return true;
}

}  // namespace

void Occluder::place_triangles(const MeshTopology& topology, std::span<const Vec3f> vertices, float ceiling) {
  const auto triangles = topology.triangles();
  const std::size_t padded = (triangles.size() + kBlock - 1) / kBlock * kBlock;
  places_.assign(triangles.size(), Place::absent);
  for (std::vector<float>* v : {&normal_x_, &normal_y_, &normal_z_, &offset_}) v->assign(padded, 0.0F);
  facing_.resize(padded);
  ignored_ = 0;
  closed_ = topology.closed();
  constexpr float kFar = 2 * kMaxCoordinate;
  Vec3f low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3f a = vertices[triangles[t][0]], b = vertices[triangles[t][1]], c = vertices[triangles[t][2]];
    if (!usable(a) || !usable(b) || !usable(c)) {
      ++ignored_;
      closed_ = false;
      continue;
    }
    const float bottom = std::min({a.z, b.z, c.z}), top = std::max({a.z, b.z, c.z});
    if (top <= 0 || bottom >= ceiling) {
      closed_ = false;
      continue;
    }
    places_[t] = bottom < 0 || top > ceiling ? Place::crossing : Place::inside;
    closed_ = closed_ && places_[t] == Place::inside;
    const Vec3f n = cross(b - a, c - a);
    normal_x_[t] = n.x;
    normal_y_[t] = n.y;
    normal_z_[t] = n.z;
    offset_[t] = -dot(n, a);
    for (const Vec3f p : {a, b, c}) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  top_ = std::clamp(high.z, 0.0F, ceiling);
  centre_ = high.z < 0 ? Vec3f{} : (low + high) * 0.5F;
}

void Occluder::add_cuts(std::span<const std::array<std::uint32_t, 3>> triangles, std::span<const Vec3f> vertices,
                        float height) {
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (places_[t] != Place::crossing) continue;
    // What is kept lies above the plane, and below the ceiling: on the side of the cut where this is positive.
    const auto depth = [&](std::size_t k) {
      const float z = vertices[triangles[t][k % 3]].z;
      return height > 0 ? height - z : z;
    };
    // The kept polygon leaves through one edge and comes back through another; the cut joins them.
    Segment cut;
    int ends = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f from = vertices[triangles[t][k]], to = vertices[triangles[t][(k + 1) % 3]];
      const float d = depth(k), e = depth(k + 1);
      if (d > 0 && e <= 0) cut.a = e < 0 ? at_height(from, to, height) : to, ++ends;
      if (d <= 0 && e > 0) cut.b = d < 0 ? at_height(from, to, height) : from, ++ends;
    }
    if (ends != 2) continue;
    segments_.push_back(cut);
    sides_.push_back({t, kNoTriangle});
  }
}

void Occluder::build(const MeshTopology& topology, std::span<const Vec3f> vertices, float ceiling) {
  place_triangles(topology, vertices, ceiling);
  segments_.clear();
  sides_.clear();
  const std::size_t most = topology.edges().size() + 2 * topology.triangles().size();
  segments_.reserve(most);
  sides_.reserve(most);
  for (const MeshEdge& edge : topology.edges()) {
    const auto absent = [&](std::uint32_t t) { return t == kNoTriangle || places_[t] == Place::absent; };
    Sides sides{edge.left, edge.right};
    Segment s{vertices[edge.from], vertices[edge.to]};
    if (absent(sides.left)) {
      // The right triangle has the edge in the other direction.
      std::swap(sides.left, sides.right);
      std::swap(s.a, s.b);
    }
    if (absent(sides.left) || !clip_segment(s, ceiling)) continue;
    if (absent(sides.right)) sides.right = kNoTriangle;
    segments_.push_back(s);
    sides_.push_back(sides);
  }
  add_cuts(topology.triangles(), vertices, 0);
  add_cuts(topology.triangles(), vertices, ceiling);
  silhouettes_.reserve(segments_.capacity());
}

void Occluder::compute_facing(std::span<const LightPoint> points) {
  for (std::size_t first = 0; first < facing_.size(); first += kBlock) {
    const float *const nx = normal_x_.data() + first, *const ny = normal_y_.data() + first,
                       *const nz = normal_z_.data() + first, *const d = offset_.data() + first;
    std::array<std::uint32_t, kBlock> turned_away{};
    // The sign bit, because compilers vectorise this and not a comparison.
    const auto mark = [&](std::size_t k, float side, std::uint32_t bit) {
      turned_away[k] |= static_cast<std::uint32_t>(std::bit_cast<std::int32_t>(side) >> 31) & bit;
    };
    for (std::size_t j = 0; j < points.size(); ++j) {
      const auto [x, y, z, w] = points[j];
      const std::uint32_t bit = 1U << j;
      if (w == 0) {
        for (std::size_t k = 0; k < kBlock; ++k) mark(k, nx[k] * x + ny[k] * y + nz[k] * z, bit);
      } else {
        for (std::size_t k = 0; k < kBlock; ++k) mark(k, nx[k] * x + ny[k] * y + nz[k] * z + d[k], bit);
      }
    }
    for (std::size_t k = 0; k < kBlock; ++k) facing_[first + k] = ~turned_away[k];
  }
}

std::span<const SilhouetteEdge> Occluder::silhouettes(std::span<const LightPoint> points) {
  compute_facing(points);
  silhouettes_.clear();
  for (std::uint32_t i = 0; i < sides_.size(); ++i) {
    const auto [left, right] = sides_[i];
    if (right == kNoTriangle) {
      silhouettes_.push_back({i, ~0U, facing_[left], true});
      continue;
    }
    const std::uint32_t changes = facing_[left] ^ facing_[right];
    if (changes != 0) silhouettes_.push_back({i, changes, facing_[left], false});
  }
  return silhouettes_;
}

}  // namespace lightwell::core
