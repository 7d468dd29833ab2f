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

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/estimator_config.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bright_pixels.hpp"

namespace lightwell::estimate {

/// The lights of a frame, in the units of its FrameIntegral.
struct DetectedLights {
  /// Light of one region in one block.
  struct Part {
    std::uint32_t block;
    std::uint8_t region;
    CellSum light;
  };

  std::vector<Light> lights;  ///< Strongest first; tracks are not set.
  int required = -1;          ///< Index of a light that must be sent because of its peak luminance; -1: none.
  /// Possible error (one sigma, luminance) of the lights' irradiance: edge pixels share the chroma of their neighbours.
  double chroma_edge_error = 0;
  std::vector<std::uint8_t> region;  ///< By light, the number of its region.
  std::vector<Part> parts;           ///< Of all regions, also of those that are no light; sorted by region.

  void clear() {
    lights.clear();
    required = -1;
    chroma_edge_error = 0;
    region.clear();
    parts.clear();
  }
  /// Subtracts lights[k] from the sums of its blocks.
  void subtract(std::size_t k, std::span<CellSum> blocks) const {
    for (const Part& part : parts) {
      if (part.region != region[k]) continue;
      CellSum& sum = blocks[part.block];
      sum.r = std::max(sum.r - part.light.r, 0.0F);
      sum.g = std::max(sum.g - part.light.g, 0.0F);
      sum.b = std::max(sum.b - part.light.b, 0.0F);
    }
  }
};

class LightFinder {
 public:
  /// Refers to all arguments.
  LightFinder(const RigTable& table, const BlockLayout& layout, const CellGrid& grid);

  /// Begins a frame, and detects the region with the brightest pixel. Reads only bright blocks. `reader` must be bound
  /// to the frames of `integral`, which must not change before find_others() returns. The result, with one light or
  /// none where there is no light or where the region is too wide, is valid until the next call.
  const DetectedLights& find_brightest(RowReader& reader, const FrameIntegral& integral, const EstimatorConfig& config);

  /// Once after find_brightest(). At most `max_lights`, including the brightest. Valid until the next call.
  const DetectedLights& find_others(RowReader& reader, int max_lights);

  /// Blocks that touch a block, across seams, poles and lenses.
  [[nodiscard]] std::span<const std::uint32_t> neighbours(std::size_t block) const { return flood_.neighbours(block); }

 private:
  using PixelId = BrightPixels::Id;
  using PixelLight = BrightPixels::Light;
  using Place = BrightPixels::Place;
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
    /// Adds radiance times solid angle, by channel and luminance. `cosine`: of the angle to the axis.
    void add(double r, double g, double b, double luminance, double cosine) {
      irradiance[0] += r * cosine;
      irradiance[1] += g * cosine;
      irradiance[2] += b * cosine;
      weight += luminance;
      spread += luminance * (1 - cosine);
    }
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
  /// Adds the connected pixels of luminance >= `floor` to the region; fills rim_ with up to kMaxRimPixels around it.
  void grow_core(RowReader& reader, float floor);
  /// After grow_core(): the same within kCosHaloReach of `axis`, without a rim.
  void grow_halo(RowReader& reader, float floor, Vec3f axis);
  /// Centroid of the core and of the light in its rim; zero if dark. Does not read blocks with peaks below `dark`.
  [[nodiscard]] Vec3d core_direction(RowReader& reader, float peak, float dark);
  /// Whether flood_ has few enough pixels, or covers little enough of the sphere, to be processed pixel by pixel.
  [[nodiscard]] bool is_compact(float peak) const;
  /// Adds the moments about `axis` of the blocks of flood_ with a mean luminance of at least `floor`.
  void gather_blocks(float floor, Vec3d axis, RegionMoments& out);
  /// Adds the moments about `axis` of the pixels of region_.
  void gather_pixels(Vec3d axis, RegionMoments& out);
  void record_part(std::uint32_t block, const CellSum& light);
  [[nodiscard]] Light region_light(RowReader& reader, std::uint32_t block, Place peak_at, float peak, bool compact);
  /// The light of the brightest remaining region that is not dark. Skips regions whose upper bound of
  /// irradiance (luminance) is below `least`.
  [[nodiscard]] std::optional<Light> next_region(RowReader& reader, double least);
  /// Smallest luminance of the halo of a light with this peak.
  [[nodiscard]] float halo_threshold(float peak) const;

  const BlockLayout& layout_;
  const CellGrid& grid_;
  const BlockSums* sums_ = nullptr;  ///< Of the current frame.
  BrightPixels pixels_;
  BlockFloodFill flood_;
  std::vector<std::uint8_t> claimed_;  ///< By pixel, the number of its region, or 0.
  std::vector<std::uint8_t> owner_;    ///< By block, the number of the region that contains all of it, or 0.
  std::vector<std::uint32_t> owned_;   ///< Blocks with an owner.
  std::uint8_t region_number_ = 0;     ///< Of the current region, from 1.
  std::uint8_t parent_ = 0;            ///< The strongest earlier region adjacent to the current one, or 0.
  std::vector<float> region_irradiance_;
  std::vector<BrightPixels::Pixel> region_, rim_;
  std::vector<PixelId> claimed_pixels_;
  DetectedLights found_;
  std::optional<Light> brightest_;
  std::uint8_t brightest_region_ = 0;  ///< Number of its region.
  float mean_ = 0, min_peak_ = 0;      ///< Luminance: mean of the frame, smallest peak of a light.
  double min_irradiance_ = 0;          ///< Smallest irradiance of a light, luminance.
  double chroma_edge_error2_ = 0;      ///< Of the current frame.
  std::span<const CellSum> scene_;     ///< Sums with whose colour that of a light is compared.
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> rejected_in_frame_;  ///< By block, the last frame in which its region was too faint.
  std::uint32_t frame_number_ = 0;
  std::size_t compact_blocks_ = 0;
};

}  // namespace lightwell::estimate
