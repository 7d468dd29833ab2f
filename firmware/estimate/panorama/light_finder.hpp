// Detects lights (lamps, the sun, windows): connected bright pixels, approximated by spherical caps.
//
// Definition, which the oracle in tests/reference follows, too: negative values count as zero. The core of a light is
// the set of pixels with at least half the peak's luminance that are connected to the peak (eight neighbours, across
// seam, poles and lenses). Its direction is the centroid of the core, weighted by luminance and solid angle; of a small
// core, the pixels around it count with the part of their luminance above their surroundings, because the light covers
// them in part. Its irradiance includes the halo: connected pixels down to kHaloThreshold of the peak.
//
// Regions are first flood-filled block by block, which gives an upper bound of their irradiance, so that regions that
// are too faint cost no access to pixels. Compact regions are then grown pixel by pixel. Wide ones (a sky, a bright
// wall) are approximated by the moments of their blocks.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/descriptor.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/panorama/block_flood_fill.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bright_pixels.hpp"

namespace lightwell::estimate {

class LightFinder {
 public:
  /// Refers to all arguments. `sums`: updated by the caller for each frame.
  LightFinder(const RigTable& table, const BlockLayout& layout, const CellGrid& grid, const BlockSums& sums);

  /// Begins a frame, whose sums must be complete, and detects the region with the brightest pixel. Reads only bright
  /// blocks. `mean_luminance`: mean over the observed directions. nullopt where there is no light, or where the region
  /// is too wide.
  [[nodiscard]] std::optional<Light> find_brightest(RowReader& reader, float mean_luminance,
                                                    const EstimatorConfig& config);

  /// Must be called once after find_brightest(). Fills `lights`, strongest first, at most `most`, always including the
  /// brightest; tracks are not set. Returns the index of the brightest, or -1 where there is none.
  int find_more(RowReader& reader, int most, std::vector<Light>& lights);

  /// Possible error (one sigma, luminance) of the irradiance of the lights found so far, due to shared chroma samples:
  /// pixels at the edge of a light have the colour of their neighbours.
  [[nodiscard]] double chroma_edge_error() const { return std::sqrt(chroma_edge_error2_); }

  /// After find_more(): subtracts the light of lights[k] from the sums of its blocks.
  void subtract(std::size_t k, std::span<CellSum> sums) const;

 private:
  using PixelId = BrightPixels::Id;
  using PixelLight = BrightPixels::Light;
  using Place = BrightPixels::Place;
  /// Light of one region in one block.
  struct RegionBlock {
    std::uint32_t block;
    std::uint8_t region;
    CellSum light;
  };
  /// A block that may contain a peak.
  struct Candidate {
    float peak;
    std::uint32_t block;
    friend bool operator<(const Candidate& a, const Candidate& b) { return a.peak < b.peak; }
  };
  /// Sums over a region.
  struct RegionMoments {
    Vec3d toward;
    double irradiance[3] = {};
    double weight = 0, spread = 0;
  };

  /// The brightest pixel of a block that belongs to no region.
  [[nodiscard]] Place peak_pixel(std::uint32_t block, float& peak) const;
  /// Runs flood_ over blocks without an owner; calls link_region() for adjacent owners. See BlockFloodFill::run().
  double flood(std::uint32_t block, float floor, Vec3f axis, float cos_reach);
  void claim(Place place, PixelId id, const PixelLight& light);
  /// Records that the current region is adjacent to `region`, which becomes its parent if it is the strongest so far.
  void link_region(std::uint8_t region);
  /// The same for the mark of a pixel, which may be that of the current region.
  void link_mark(std::uint8_t mark);
  /// Null outside of the blocks of flood_, and where memory for pixels is exhausted.
  [[nodiscard]] const PixelLight* light_in_flood(RowReader& reader, Place p);
  /// Adds the connected pixels with a luminance of at least `floor` to the region. Fills rim_ with the adjacent pixels,
  /// at most kMaxRimPixels.
  void grow_core(RowReader& reader, float floor);
  /// After grow_core(): the same within kCosHaloReach of `axis`, without a rim.
  void grow_halo(RowReader& reader, float floor, Vec3f axis);
  /// Centroid of the core and of the part of the light in its rim; zero where both are dark. Blocks whose peak is below
  /// `dark` (luminance) are not read.
  [[nodiscard]] Vec3d core_direction(RowReader& reader, float peak, float dark);
  /// Whether flood_ has few enough pixels, or covers little enough of the sphere, to be processed pixel by pixel.
  [[nodiscard]] bool is_compact(float peak) const;
  /// Adds the moments about `axis` of the blocks of flood_ with a mean luminance of at least `floor`.
  void gather_blocks(float floor, Vec3d axis, RegionMoments& out);
  /// Adds the moments about `axis` of the pixels of region_.
  void gather_pixels(Vec3d axis, RegionMoments& out);
  /// Possible error of the irradiance of a light as small as one chroma sample.
  [[nodiscard]] double chroma_edge_error_of(const RowReader& reader, const RegionMoments& light) const;
  void record_part(std::uint32_t block, const CellSum& light);
  [[nodiscard]] Light region_light(RowReader& reader, std::uint32_t block, Place peak_at, float peak, bool compact);
  /// The light of the brightest remaining region with a nonzero irradiance. Skips regions whose upper bound of the
  /// irradiance (luminance) is below `least`.
  [[nodiscard]] std::optional<Light> next_region(RowReader& reader, double least);
  /// Smallest luminance of the halo of a light with this peak.
  [[nodiscard]] float halo_threshold(float peak) const;

  const BlockLayout& layout_;
  const CellGrid& grid_;
  const BlockSums& sums_;
  BrightPixels pixels_;
  BlockFloodFill flood_;
  std::vector<std::uint8_t> claimed_;  ///< By pixel, the number of its region, or 0.
  std::vector<std::uint8_t> owner_;    ///< By block, the number of the region that contains all of it, or 0.
  std::vector<std::uint32_t> owned_;   ///< Blocks with an owner.
  std::uint8_t region_number_ = 0;     ///< Of the current region, from 1.
  std::uint8_t parent_ = 0;            ///< The strongest earlier region adjacent to the current one, or 0.
  std::vector<float> region_irradiance_;
  std::vector<RegionBlock> parts_;  ///< Of all regions, sorted by region.
  std::vector<std::uint8_t> region_of_light_;
  std::vector<BrightPixels::Pixel> region_, rim_;
  std::vector<PixelId> claimed_pixels_;
  std::optional<Light> brightest_;
  std::uint8_t brightest_region_ = 0;  ///< Number of its region.
  float mean_ = 0, min_peak_ = 0;      ///< Luminance: mean of the frame, smallest peak of a light.
  double min_irradiance_ = 0;          ///< Smallest irradiance of a light, luminance.
  double chroma_edge_error2_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> rejected_in_frame_;  ///< By block, the last frame in which its region was too faint.
  std::uint32_t frame_number_ = 0;
  std::size_t compact_blocks_ = 0;
};

}  // namespace lightwell::estimate
