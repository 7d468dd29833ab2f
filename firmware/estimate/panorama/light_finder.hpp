// Lamps, the sun, windows: connected bright pixels become caps of light.
//
// The written rule, which the oracle in tests/reference follows too: negatives count as zero; the region of a light is
// the pixels connected (eight neighbours, across seam, poles and lenses) to its peak with at least half the peak's
// luminance; its direction is the centroid of that region, weighted by luminance and solid angle (of a region of few
// pixels with what the pixels around it hold of the light: it covers them in part).
// Its energy is gathered further down, to kSkirt of the peak, as a lens and a lamp's own glow spread it.
//
// Regions are first walked block by block, which bounds what they can give: a spot too faint to matter costs no pixel. A
// compact one is walked pixel by pixel; a wide one (a sky, a lit wall) is told well enough by the moments of its blocks.
#pragma once

#include <cmath>
#include <cstdint>
#include <lightwell/config.hpp>
#include <lightwell/descriptor.hpp>
#include <span>
#include <vector>

#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bright_pixels.hpp"
#include "estimate/panorama/row_reader.hpp"

namespace lightwell::estimate {

class LightFinder {
 public:
  LightFinder(const RigTable& table, const BlockLayout& layout);

  /// Fills `lights`: strongest first, at most config.max_lights, no tracks yet. Only bright blocks are read again.
  /// `mean_luminance` is that of what the rig sees. Returns which of them is the region with the brightest pixel, or -1
  /// where that is too wide to be a light.
  int find(RowReader& reader, const BlockSums& sums, const CellGrid& grid, float mean_luminance,
            const EstimatorConfig& config, std::vector<Light>& lights);

  /// After find(): how much of the lights' irradiance, summed as luminance, may be wrong where pixels share their colour:
  /// those at the edge of a light have that of what is beside it.
  [[nodiscard]] double doubt() const { return std::sqrt(doubt2_); }

  /// After find(): takes the light of lights[k], as find() left them, out of the blocks that it came from.
  void take_out(std::size_t k, std::span<CellSum> sums) const;

 private:
  using PixelId = BrightPixels::Id;
  using PixelLight = BrightPixels::Light;
  using Place = BrightPixels::Place;
  struct Part {
    std::uint32_t block;
    std::uint8_t region;
    CellSum light;
  };
  struct Candidate {
    float peak;
    std::uint32_t block;
    friend bool operator<(const Candidate& a, const Candidate& b) { return a.peak < b.peak; }
  };
  enum class RegionPart { core, skirt };
  /// Sums over a region as they grow.
  struct Gathered {
    Vec3d toward;
    double irradiance[3] = {};
    double weight = 0, spread = 0;
  };

  void plan_neighbours(const RigTable& table);
  /// The brightest pixel of a block that no region has yet.
  [[nodiscard]] Place peak_pixel(std::uint32_t block, float& peak) const;
  /// Fills flood_ with the blocks connected to `block` (itself first) whose peak is at least `floor` and whose
  /// middle is within `cos_reach` of `axis`; stops at kMostFlood. Returns their luminance together, over that of the darkest
  /// block around them.
  double flood(const BlockSums& sums, const CellGrid& grid, std::uint32_t block, float floor, Vec3f axis, float cos_reach);
  void claim(Place place, PixelId id, const PixelLight& light);
  /// Adds to the region all that is connected to it, at least `floor` bright and within `cos_reach` of `axis`.
  void grow(RowReader& reader, RegionPart part, float floor, Vec3f axis, float cos_reach);
  /// Centroid of the region as it is a core alone; zero where it is dark. Blocks without a pixel of `dark` are not read.
  [[nodiscard]] Vec3d core_direction(RowReader& reader, const BlockSums& sums, float peak, float dark);
  /// Whether flood_ is few enough pixels, or small enough, to be walked pixel by pixel.
  [[nodiscard]] bool is_compact(const BlockSums& sums, const CellGrid& grid, float peak) const;
  /// Whole blocks of flood_ that are bright all over, about `axis`.
  void gather_blocks(const BlockSums& sums, const CellGrid& grid, float floor, Vec3d axis, Gathered& out);
  void gather_pixels(Vec3d axis, Gathered& out);
  /// Irradiance of a light of one sample of colour that may be another's.
  [[nodiscard]] double wrong_at_edge(const RowReader& reader, const BlockSums& sums, const Gathered& light) const;
  void note(std::uint32_t block, const CellSum& light);
  [[nodiscard]] Light region_light(RowReader& reader, const BlockSums& sums, const CellGrid& grid, std::uint32_t block,
                                   Place peak_at, float peak, float skirt, bool compact);

  const BlockLayout& layout_;
  BrightPixels pixels_;
  /// Blocks beside each block, across seams, poles and lenses: first_[b] to first_[b + 1] of beside_.
  std::vector<std::uint32_t> beside_first_, beside_;
  std::vector<std::uint8_t> claimed_;  ///< 0, or the number of the region that a pixel belongs to.
  std::vector<std::uint8_t> owner_;    ///< The same of whole blocks.
  std::vector<std::uint32_t> owned_;   ///< Blocks with an owner.
  std::uint8_t number_ = 0;            ///< Of the region that grows, from 1.
  std::uint8_t parent_ = 0;            ///< The strongest earlier region that it touches, or 0.
  std::vector<float> region_irradiance_;
  std::vector<Part> parts_;                  ///< Of all regions, by ascending region.
  std::vector<std::uint8_t> region_of_light_;
  std::vector<BrightPixels::Pixel> region_, rim_;
  std::vector<PixelId> all_claimed_;
  double doubt2_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> flood_, flood_mark_;
  std::vector<std::uint32_t> passed_over_;  ///< The frame in which the block was last part of what is too faint.
  std::uint32_t frame_number_ = 0;
  std::uint32_t flood_number_ = 0;
  std::size_t compact_blocks_ = 0;
};

}  // namespace lightwell::estimate
