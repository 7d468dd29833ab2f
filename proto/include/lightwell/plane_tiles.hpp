// Tiles of a captured plane, in which it is sent. Specification: proto/README.md, "Captured planes".
#pragma once

#include <cstddef>
#include <cstdint>

#include <lightwell/hemisphere_grid.hpp>

namespace lightwell {

enum class PlanePart : std::uint8_t { texture, lumisphere, coverage };

/// How the entries (texels, nodes) of a plane are divided into tiles, and the order of the tiles: those of the texture,
/// row by row from the top, then those of the lumisphere, then those of the coverage.
class PlaneTileLayout {
 public:
  static constexpr int kTextureTileEdge = 32;
  static constexpr std::size_t kLumisphereTileNodes = 1024, kCoverageTileNodes = 8192;

  PlaneTileLayout() = default;
  /// Sizes within the limits of captured_plane.hpp.
  PlaneTileLayout(int texture_edge, int lumisphere_levels, int coverage_levels);

  [[nodiscard]] int texture_edge() const { return edge_; }
  [[nodiscard]] int lumisphere_levels() const { return lumisphere_levels_; }
  [[nodiscard]] int coverage_levels() const { return coverage_levels_; }

  /// Number of tiles.
  [[nodiscard]] std::size_t size() const { return texture_tiles() + lumisphere_tiles() + coverage_tiles(); }
  [[nodiscard]] PlanePart part(std::size_t tile) const;
  /// Number of entries of a tile.
  [[nodiscard]] std::size_t entries(std::size_t tile) const;
  /// Index of entry k of a tile in the arrays of its part. Of the texture: row by row within the tile.
  [[nodiscard]] std::size_t entry(std::size_t tile, std::size_t k) const;
  /// The tile that holds this entry.
  [[nodiscard]] std::size_t tile_of(PlanePart part, std::size_t entry) const;

  friend bool operator==(const PlaneTileLayout&, const PlaneTileLayout&) = default;

 private:
  [[nodiscard]] std::size_t across() const {
    return static_cast<std::size_t>((edge_ + kTextureTileEdge - 1) / kTextureTileEdge);
  }
  [[nodiscard]] std::size_t texture_tiles() const { return across() * across(); }
  [[nodiscard]] std::size_t lumisphere_tiles() const {
    return (HemisphereGrid(lumisphere_levels_).size() + kLumisphereTileNodes - 1) / kLumisphereTileNodes;
  }
  [[nodiscard]] std::size_t coverage_tiles() const {
    return (HemisphereGrid(coverage_levels_).size() + kCoverageTileNodes - 1) / kCoverageTileNodes;
  }
  /// Width and height of a tile of the texture.
  [[nodiscard]] std::size_t columns(std::size_t tile) const;
  [[nodiscard]] std::size_t rows(std::size_t tile) const;

  int edge_ = 0, lumisphere_levels_ = 1, coverage_levels_ = 1;
};

}  // namespace lightwell
