#include <algorithm>

#include <lightwell/captured_plane.hpp>
#include <lightwell/plane_tiles.hpp>

namespace lightwell {

PlaneTileLayout::PlaneTileLayout(int texture_edge, int lumisphere_levels, int coverage_levels)
    : edge_(std::clamp(texture_edge, 0, kMaxPlaneTextureEdge)),
      lumisphere_levels_(std::clamp(lumisphere_levels, 1, kMaxPlaneLevels)),
      coverage_levels_(std::clamp(coverage_levels, 1, kMaxPlaneLevels)) {}

PlanePart PlaneTileLayout::part(std::size_t tile) const {
  if (tile < texture_tiles()) return PlanePart::texture;
  return tile < texture_tiles() + lumisphere_tiles() ? PlanePart::lumisphere : PlanePart::coverage;
}

std::size_t PlaneTileLayout::columns(std::size_t tile) const {
  const std::size_t left = tile % across() * kTextureTileEdge;
  return std::min<std::size_t>(kTextureTileEdge, static_cast<std::size_t>(edge_) - left);
}

std::size_t PlaneTileLayout::rows(std::size_t tile) const {
  const std::size_t top = tile / across() * kTextureTileEdge;
  return std::min<std::size_t>(kTextureTileEdge, static_cast<std::size_t>(edge_) - top);
}

std::size_t PlaneTileLayout::entries(std::size_t tile) const {
  switch (part(tile)) {
    case PlanePart::texture:
      return columns(tile) * rows(tile);
    case PlanePart::lumisphere:
      return std::min(kLumisphereTileNodes, HemisphereGrid(lumisphere_levels_).size() - entry(tile, 0));
    case PlanePart::coverage:
      break;
  }
  return std::min(kCoverageTileNodes, HemisphereGrid(coverage_levels_).size() - entry(tile, 0));
}

std::size_t PlaneTileLayout::entry(std::size_t tile, std::size_t k) const {
  switch (part(tile)) {
    case PlanePart::texture: {
      const std::size_t row = tile / across() * kTextureTileEdge + k / columns(tile);
      const std::size_t column = tile % across() * kTextureTileEdge + k % columns(tile);
      return row * static_cast<std::size_t>(edge_) + column;
    }
    case PlanePart::lumisphere:
      return (tile - texture_tiles()) * kLumisphereTileNodes + k;
    case PlanePart::coverage:
      break;
  }
  return (tile - texture_tiles() - lumisphere_tiles()) * kCoverageTileNodes + k;
}

std::size_t PlaneTileLayout::tile_of(PlanePart part, std::size_t entry) const {
  switch (part) {
    case PlanePart::texture: {
      const std::size_t row = entry / static_cast<std::size_t>(edge_), column = entry % static_cast<std::size_t>(edge_);
      return row / kTextureTileEdge * across() + column / kTextureTileEdge;
    }
    case PlanePart::lumisphere:
      return texture_tiles() + entry / kLumisphereTileNodes;
    case PlanePart::coverage:
      break;
  }
  return texture_tiles() + lumisphere_tiles() + entry / kCoverageTileNodes;
}

}  // namespace lightwell
