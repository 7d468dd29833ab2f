#include "core/mesh_topology.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <tuple>

namespace lightwell::core {
namespace {

std::size_t hash_of(Vec3f p) {
  // + 0 makes a negative zero positive.
  std::uint64_t h = std::bit_cast<std::uint32_t>(p.x + 0.0F);
  h = (h ^ (h >> 15)) * 0x9e3779b97f4a7c15U + std::bit_cast<std::uint32_t>(p.y + 0.0F);
  h = (h ^ (h >> 29)) * 0x9e3779b97f4a7c15U + std::bit_cast<std::uint32_t>(p.z + 0.0F);
  h = (h ^ (h >> 32)) * 0x9e3779b97f4a7c15U;
  return static_cast<std::size_t>(h >> 16);
}

}  // namespace

bool MeshTopology::current(std::span<const Vec3f> positions, std::span<const std::uint32_t> indices) const {
  if (positions.size() != first_.size() || !std::ranges::equal(indices, indices_)) return false;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (first_[i] != i && !(positions[first_[i]] == positions[i])) return false;
  return true;
}

void MeshTopology::weld(std::span<const Vec3f> positions) {
  const std::size_t slots = std::bit_ceil(2 * positions.size() + 2);
  hash_slots_.assign(slots, kNoTriangle);
  first_.resize(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    // A vertex that is NaN equals none, not even itself: in a slot it would lengthen the search for every later one.
    if (!(positions[i] == positions[i])) {
      first_[i] = i;
      continue;
    }
    std::size_t slot = hash_of(positions[i]) & (slots - 1);
    while (hash_slots_[slot] != kNoTriangle && !(positions[hash_slots_[slot]] == positions[i]))
      slot = (slot + 1) & (slots - 1);
    if (hash_slots_[slot] == kNoTriangle) hash_slots_[slot] = i;
    first_[i] = hash_slots_[slot];
  }
}

void MeshTopology::pair_edges() {
  half_edges_.clear();
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
      const std::uint64_t key = (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
      half_edges_.push_back({key, t, a > b ? 1U : 0U});
    }
  }
  // In each group of one edge the ascending half edges come first.
  std::ranges::sort(half_edges_, {}, [](const HalfEdge& h) { return std::tuple(h.key, h.descending, h.triangle); });
  edges_.clear();
  closed_ = true;
  const auto add = [&](const HalfEdge& h, std::uint32_t right) {
    const auto small = static_cast<std::uint32_t>(h.key >> 32), large = static_cast<std::uint32_t>(h.key);
    if (h.descending == 0)
      edges_.push_back({small, large, h.triangle, right});
    else
      edges_.push_back({large, small, h.triangle, right});
    closed_ = closed_ && right != kNoTriangle;
  };
  for (std::size_t begin = 0, end = 0; begin < half_edges_.size(); begin = end) {
    std::size_t descending = begin;
    for (end = begin; end < half_edges_.size() && half_edges_[end].key == half_edges_[begin].key; ++end)
      if (half_edges_[end].descending == 0) descending = end + 1;
    const std::size_t pairs = std::min(descending - begin, end - descending);
    for (std::size_t k = 0; k < pairs; ++k) add(half_edges_[begin + k], half_edges_[descending + k].triangle);
    for (std::size_t k = begin + pairs; k < descending; ++k) add(half_edges_[k], kNoTriangle);
    for (std::size_t k = descending + pairs; k < end; ++k) add(half_edges_[k], kNoTriangle);
  }
}

void MeshTopology::update(std::span<const Vec3f> positions, std::span<const std::uint32_t> indices) {
  if (current(positions, indices)) return;
  // Until the end nothing is current: memory may run out on the way.
  indices_.clear();
  triangles_.clear();
  edges_.clear();
  weld(positions);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const std::array<std::uint32_t, 3> t{first_[indices[i]], first_[indices[i + 1]], first_[indices[i + 2]]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles_.push_back(t);
  }
  half_edges_.reserve(indices.size());
  edges_.reserve(indices.size());
  pair_edges();
  indices_.assign(indices.begin(), indices.end());
}

}  // namespace lightwell::core
