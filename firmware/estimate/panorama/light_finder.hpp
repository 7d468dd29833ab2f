// Lamps, the sun, windows: connected bright pixels become caps of light.
//
// The written rule, which the oracle in tests/reference follows too: negatives count as zero; the region of a light is
// the pixels connected (eight neighbours, across seam, poles and lenses) to its peak with at least half the peak's
// luminance; its direction is the centroid of that region, weighted by luminance and solid angle (of a region of few
// pixels with what the pixels around it hold of the light: it covers them in part).
// Its energy is gathered further down, to kHaloThreshold of the peak, as a lens and a lamp's own glow spread it.
//
// Regions are first walked block by block, which bounds what they can give: a spot too faint to matter costs no pixel.
// A compact one is walked pixel by pixel; a wide one (a sky, a lit wall) is told well enough by the moments of its
// blocks.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/descriptor.hpp>

#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/panorama/block_flood_fill.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bright_pixels.hpp"

namespace lightwell::estimate {

class LightFinder {
 public:
  /// All stay the caller's; `sums` are those of each frame in turn.
  LightFinder(const RigTable& table, const BlockLayout& layout, const CellGrid& grid, const BlockSums& sums);

  /// Begins a frame, whose sums are there: the region with the brightest pixel alone. Only bright blocks are read
  /// again. `mean_luminance` is that of what the rig sees. Nothing where there is no light, or where it is too wide to
  /// be one.
  [[nodiscard]] std::optional<Light> find_brightest(RowReader& reader, float mean_luminance,
                                                    const EstimatorConfig& config);

  /// Once after find_brightest(): fills `lights`, strongest first, at most `most` of them, the brightest always among
  /// them, no tracks yet. Returns which it is, or -1 where there is none.
  int find_more(RowReader& reader, int most, std::vector<Light>& lights);

  /// How much of the irradiance of the lights so far, summed as luminance, may be wrong where pixels share their
  /// colour: those at the edge of a light have that of what is beside it.
  [[nodiscard]] double chroma_edge_error() const { return std::sqrt(chroma_edge_error2_); }

  /// After find_more(): takes the light of lights[k], as it left them, out of the blocks that it came from.
  void take_out(std::size_t k, std::span<CellSum> sums) const;

 private:
  using PixelId = BrightPixels::Id;
  using PixelLight = BrightPixels::Light;
  using Place = BrightPixels::Place;
  struct RegionBlock {
    std::uint32_t block;
    std::uint8_t region;
    CellSum light;
  };
  struct Candidate {
    float peak;
    std::uint32_t block;
    friend bool operator<(const Candidate& a, const Candidate& b) { return a.peak < b.peak; }
  };
  /// Sums over a region as they grow.
  struct RegionMoments {
    Vec3d toward;
    double irradiance[3] = {};
    double weight = 0, spread = 0;
  };

  /// The brightest pixel of a block that no region has yet.
  [[nodiscard]] Place peak_pixel(std::uint32_t block, float& peak) const;
  /// Fills flood_ with blocks that no region has; those that one has are touched. As BlockFloodFill::run().
  double flood(std::uint32_t block, float floor, Vec3f axis, float cos_reach);
  void claim(Place place, PixelId id, const PixelLight& light);
  /// The region that grows touches another, which becomes its parent where it is the strongest so far.
  void link_region(std::uint8_t region);
  /// The same of a pixel's mark, which may be the region's own.
  void link_mark(std::uint8_t mark);
  /// Null beyond the blocks that the flood reached, where nothing is bright enough, and where there is no more room.
  [[nodiscard]] const PixelLight* light_in_flood(RowReader& reader, Place p);
  /// Adds to the region all that is connected to it and at least `floor` bright. What is beside it is then the rim,
  /// unless that is more than kMaxRimPixels.
  void grow_core(RowReader& reader, float floor);
  /// After grow_core(): the same within kCosReach of `axis`.
  void grow_halo(RowReader& reader, float floor, Vec3f axis);
  /// Centroid of the region while it is a core alone, and of what its rim holds of the light; zero where it is dark.
  /// Blocks without a pixel of `dark` are not read.
  [[nodiscard]] Vec3d core_direction(RowReader& reader, float peak, float dark);
  /// Whether flood_ is few enough pixels, or small enough, to be walked pixel by pixel.
  [[nodiscard]] bool is_compact(float peak) const;
  /// Whole blocks of flood_ that are bright all over, about `axis`.
  void gather_blocks(float floor, Vec3d axis, RegionMoments& out);
  void gather_pixels(Vec3d axis, RegionMoments& out);
  /// Irradiance of a light of one sample of colour that may be another's.
  [[nodiscard]] double chroma_edge_error_of(const RowReader& reader, const RegionMoments& light) const;
  void record_part(std::uint32_t block, const CellSum& light);
  [[nodiscard]] Light region_light(RowReader& reader, std::uint32_t block, Place peak_at, float peak, bool compact);
  /// The brightest that is left and gives anything. Those whose blocks cannot hold `least` (irradiance, as luminance)
  /// are passed over.
  [[nodiscard]] std::optional<Light> next_region(RowReader& reader, double least);
  /// Down to which luminance a light with this peak is gathered.
  [[nodiscard]] float halo_threshold(float peak) const;

  const BlockLayout& layout_;
  const CellGrid& grid_;
  const BlockSums& sums_;
  BrightPixels pixels_;
  BlockFloodFill flood_;
  std::vector<std::uint8_t> claimed_;  ///< 0, or the number of the region that a pixel belongs to.
  std::vector<std::uint8_t> owner_;    ///< The same of whole blocks.
  std::vector<std::uint32_t> owned_;   ///< Blocks with an owner.
  std::uint8_t number_ = 0;            ///< Of the region that grows, from 1.
  std::uint8_t parent_ = 0;            ///< The strongest earlier region that it touches, or 0.
  std::vector<float> region_irradiance_;
  std::vector<RegionBlock> parts_;  ///< Of all regions, by ascending region.
  std::vector<std::uint8_t> region_of_light_;
  std::vector<BrightPixels::Pixel> region_, rim_;
  std::vector<PixelId> all_claimed_;
  std::optional<Light> brightest_;
  std::uint8_t brightest_number_ = 0;  ///< Its region.
  float mean_ = 0, floor_ = 0;         ///< Luminance: mean of the frame, and least peak of a light.
  double faintest_ = 0;                ///< Least irradiance of a light, as luminance.
  double chroma_edge_error2_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> passed_over_;  ///< The frame in which the block was last part of what is too faint.
  std::uint32_t frame_number_ = 0;
  std::size_t compact_blocks_ = 0;
};

}  // namespace lightwell::estimate
