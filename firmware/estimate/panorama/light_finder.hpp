// Lamps, the sun, windows: connected bright pixels become caps of light.
//
// The written rule, which the oracle in tests/reference follows too: negatives count as zero; the region of a light is
// the pixels connected (eight neighbours, across seam, poles and lenses) to its peak with at least half the peak's
// luminance; its direction is the centroid of that region, weighted by luminance and solid angle.
// Its energy is gathered further down, to kSkirt of the peak, as a lens and a lamp's own glow spread it.
#pragma once

#include <cstdint>
#include <lightwell/config.hpp>
#include <lightwell/descriptor.hpp>
#include <span>
#include <vector>

#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/row_reader.hpp"

namespace lightwell::estimate {

class LightFinder {
 public:
  LightFinder(const RigTable& table, const BlockLayout& layout);

  /// Fills `lights` (strongest first, at most config.max_lights, no tracks yet) and `moved`: the blocks whose light
  /// does not sit evenly, with its centroid. Only bright blocks are read again. `mean_luminance` is that of what the
  /// rig sees.
  void find(RowReader& reader, const BlockSums& sums, const CellGrid& grid, float mean_luminance,
            const EstimatorConfig& config, std::vector<Light>& lights, std::vector<CellGrid::Moved>& moved);

 private:
  using PixelId = std::uint32_t;  ///< Of all lenses one after another.
  struct Candidate {
    float peak;
    std::uint32_t block;
    friend bool operator<(const Candidate& a, const Candidate& b) { return a.peak < b.peak; }
  };
  struct PixelPlace {
    int lens, x, y;
  };
  struct PixelLight {
    float r, g, b, luminance;
  };
  struct RegionPixel {
    PixelPlace place;
    PixelId id;
    PixelLight light;
  };

  void load(RowReader& reader, std::uint32_t block);
  [[nodiscard]] PixelId id_of(int lens, int x, int y) const;
  /// Its light, reading its block first where that has not happened; darkness where the room for blocks is used up.
  [[nodiscard]] PixelLight light_of(RowReader& reader, PixelPlace p);
  template <class Visit>
  void for_neighbours(PixelPlace p, Visit&& visit) const;
  void claim(PixelPlace place, PixelId id, const PixelLight& light);
  /// Adds to the region all that is connected to it, at least `floor` bright and within `cos_reach` of `axis`.
  void grow(RowReader& reader, float floor, Vec3f axis, float cos_reach);
  [[nodiscard]] Vec3f direction(const RegionPixel& pixel) const;
  [[nodiscard]] float solid_angle(const RegionPixel& pixel) const;
  /// Centroid of the first `core` pixels of the region; zero where they are dark.
  [[nodiscard]] Vec3d core_direction(std::size_t core) const;
  /// The light of the whole region, in the direction of its first `core` pixels.
  [[nodiscard]] Light measure(std::size_t core, Vec3d axis, int pixels_per_color) const;
  void centroids(const BlockSums& sums, const CellGrid& grid, std::vector<CellGrid::Moved>& moved) const;

  const RigTable& table_;
  const BlockLayout& layout_;
  std::vector<PixelId> lens_first_;
  std::vector<std::uint8_t> claimed_;  ///< 0, or the number of the region that a pixel belongs to.
  std::uint8_t number_ = 0;            ///< Of the region that grows, from 1.
  std::uint8_t parent_ = 0;            ///< The strongest earlier region that it touches, or 0.
  std::vector<float> region_irradiance_;
  std::vector<RegionPixel> region_;
  std::vector<PixelId> all_claimed_;
  std::vector<Candidate> candidates_;
  std::vector<std::int32_t> slot_of_block_;
  std::vector<std::uint32_t> loaded_;
  std::vector<PixelLight> pool_;  ///< edge² entries a slot.
  LinearRow row_;
  std::size_t slots_;
};

}  // namespace lightwell::estimate
