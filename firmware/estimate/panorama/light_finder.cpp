#include "estimate/panorama/light_finder.hpp"

#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>

#include "estimate/common/error_bound.hpp"

namespace lightwell::estimate {

/// The halo extends down to this share of the peak, or to kHaloOverMean times the mean if that is more.
constexpr float kHaloThreshold = 0.02F, kHaloOverMean = 3;
/// Radius of the halo around the centroid: wider glow is described better by the harmonics.
const float kCosHaloReach = std::cos(12 * std::numbers::pi_v<float> / 180);
/// The same for the middles of blocks, some of whose pixels are nearer.
const float kCosHaloReachOfBlocks = std::cos(16 * std::numbers::pi_v<float> / 180);
/// Largest angle between two points of one light.
const float kCosMaxExtent = std::cos(24 * std::numbers::pi_v<float> / 180);
/// Largest radius of a light, rad: wider regions cast no distinct shadow.
constexpr float kMaxAngularRadius = 0.6F;
/// Smallest share of the total irradiance of a light; fainter ones are left to the harmonics.
constexpr double kMinIrradianceFraction = 0.002;
/// The same, relative to epsilon, where only irradiance is limited. A light with the share s of all light has a
/// relative RMS irradiance of 1.6 s, 9 % of it above band 2: 64 omitted lights of epsilon / 2 add up to 0.6 epsilon in
/// quadrature, and the bands above 2 cost fewer bytes than the lights.
constexpr double kMinFractionOfEpsilon = 0.5;
/// Once the limit on lights is reached, a candidate must exceed the weakest light by this factor.
constexpr double kReplacementRatio = 1.1;
/// Largest number of regions per frame; limits the time in scenes with very many lamps.
constexpr int kMaxRegions = 96;
/// A region adjacent to an earlier one with less than this share of its irradiance is a part of its glow.
constexpr float kHaloFraction = 0.1F;
/// A region is compact, and processed pixel by pixel, with at most this many pixels or blocks.
constexpr std::size_t kCompactPixels = 2048, kCompactBlocks = 9;
/// It is also compact with a solid angle of at most kCompactPixels mean pixels (pixels are small around the poles of an
/// equirectangular image), or with at most this many blocks whose light at peak luminance would cover no more.
constexpr std::size_t kMaxHalfLitBlocks = 32;
/// Pixels around a core of at most this many pixels contribute to its direction. The effect is small for large cores:
/// half a pixel on one side moves the centroid of n pixels by less than 1 / sqrt(n) pixels.
constexpr std::size_t kMaxCoreWithRim = 256;
/// A pixel has at most 17 neighbours (8, and 9 of the other lens).
constexpr std::size_t kMaxRimPixels = 17 * kMaxCoreWithRim;
/// Error of the centroid of luminance in a Bayer mosaic, which is 72 % green with two samples in a quad, relative to
/// that with one sample: 0.213 + 0.715 * 2^-0.75 + 0.072.
constexpr double kMosaicCentroidError = 0.71;
/// A light is required where its peak luminance exceeds the mean by this factor.
constexpr float kMinPeakRatio = 100;
constexpr std::uint8_t kRim = 255;  ///< Temporary mark of rim pixels; regions are numbered up to kMaxRegions.
constexpr std::size_t kMaxParts = 65536;
constexpr std::size_t kMaxRegionPixels = 400'000;

LightFinder::LightFinder(const RigTable& table, const BlockLayout& layout, const CellGrid& grid)
    : layout_(layout), grid_(grid), pixels_(table, layout), flood_(table, layout, grid, pixels_) {
  claimed_.resize(pixels_.size());
  owner_.resize(layout.size());
  owned_.reserve(layout.size());
  rejected_in_frame_.resize(layout.size());
  region_.reserve(std::min(pixels_.size(), kMaxRegionPixels) + 16);
  claimed_pixels_.reserve(region_.capacity());
  candidates_.reserve(layout.size() + 1);
  region_irradiance_.resize(kMaxRegions + 1);
  found_.lights.reserve(kMaxLights + 1);
  found_.region.reserve(kMaxLights + 1);
  found_.parts.reserve(kMaxParts);
  rim_.reserve(kMaxRimPixels);
  compact_blocks_ = std::max(kCompactBlocks, kCompactPixels / static_cast<std::size_t>(layout.edge() * layout.edge()));
}

float LightFinder::halo_threshold(float peak) const { return std::max(kHaloThreshold * peak, kHaloOverMean * mean_); }

LightFinder::Place LightFinder::peak_pixel(std::uint32_t block, float& peak) const {
  const BlockLayout::Place p = layout_.place(block);
  Place at{p.lens, p.x, p.y};
  peak = 0;
  for (int y = p.y; y < p.y + p.height; ++y) {
    const PixelLight* row = &pixels_.light({p.lens, p.x, y});
    for (int x = 0; x < p.width; ++x) {
      if (!(row[x].luminance > peak)) continue;
      const Place here{p.lens, p.x + x, y};
      if (claimed_[pixels_.id(here)] != 0 || pixels_.at_edge(here)) continue;
      peak = row[x].luminance;
      at = here;
    }
  }
  return at;
}

void LightFinder::claim(Place place, PixelId id, const PixelLight& light) {
  claimed_[id] = region_number_;
  region_.push_back({place, id, light});
  claimed_pixels_.push_back(id);
}

double LightFinder::flood(std::uint32_t block, float floor, Vec3f axis, float cos_reach) {
  return flood_.run(*sums_, block, floor, axis, cos_reach, [&](std::uint32_t other) {
    if (owner_[other] == 0) return false;
    link_region(owner_[other]);
    return true;
  });
}

void LightFinder::link_region(std::uint8_t region) {
  if (parent_ == 0 || region_irradiance_[region] > region_irradiance_[parent_]) parent_ = region;
}

void LightFinder::link_mark(std::uint8_t mark) {
  if (mark != region_number_ && mark != kRim) link_region(mark);
}

const LightFinder::PixelLight* LightFinder::light_in_flood(RowReader& reader, Place p) {
  const std::size_t block = layout_.block_of(p.lens, p.x, p.y);
  if (!flood_.has(block) || claimed_pixels_.size() + 1 >= claimed_pixels_.capacity()) return nullptr;
  return pixels_.light(reader, block, p);
}

void LightFinder::grow_core(RowReader& reader, float floor) {
  rim_.clear();
  for (std::size_t next = 0; next < region_.size(); ++next) {
    pixels_.for_each_neighbour(region_[next].place, [&](Place p, PixelId id) {
      if (claimed_[id] != 0) return link_mark(claimed_[id]);
      const PixelLight* light = light_in_flood(reader, p);
      if (light != nullptr && light->luminance >= floor && !pixels_.at_edge(p) &&
          pixels_.solid_angle({p, id, *light}) > 0)
        return claim(p, id, *light);
      if (rim_.size() == kMaxRimPixels) return;
      claimed_[id] = kRim;
      rim_.push_back({p, id, {}});
    });
  }
  for (const BrightPixels::Pixel& pixel : rim_) claimed_[pixel.id] = 0;
}

void LightFinder::grow_halo(RowReader& reader, float floor, Vec3f axis) {
  const std::size_t core = region_.size();
  const auto consider = [&](Place p, PixelId id) {
    if (claimed_[id] != 0) return link_mark(claimed_[id]);
    const PixelLight* light = light_in_flood(reader, p);
    if (light == nullptr || light->luminance < floor) return;
    const BrightPixels::Pixel pixel{p, id, *light};
    if (pixels_.solid_angle(pixel) > 0 && dot(pixels_.direction(pixel), axis) >= kCosHaloReach) claim(p, id, *light);
  };
  // A complete rim contains all neighbours of the core.
  for (const BrightPixels::Pixel& pixel : rim_) consider(pixel.place, pixel.id);
  for (std::size_t next = rim_.size() < kMaxRimPixels ? core : 0; next < region_.size(); ++next)
    pixels_.for_each_neighbour(region_[next].place, consider);
}

Vec3d LightFinder::core_direction(RowReader& reader, float peak, float dark) {
  Vec3d toward;
  const auto add = [&](const BrightPixels::Pixel& pixel, float luminance) {
    toward +=
        vec_cast<double>(pixels_.direction(pixel)) * (static_cast<double>(luminance) * pixels_.solid_angle(pixel));
  };
  for (const BrightPixels::Pixel& pixel : region_) add(pixel, pixel.light.luminance);
  if (region_.size() > kMaxCoreWithRim) return normalized(toward);
  // Of pixels that the light covers in part, the luminance above the darkest neighbour's belongs to it.
  const auto is_dark = [&](std::size_t block) { return !pixels_.has(block) && sums_->peak[block] < dark; };
  for (BrightPixels::Pixel& pixel : rim_) {
    const std::size_t block = layout_.block_of(pixel.place.lens, pixel.place.x, pixel.place.y);
    const PixelLight* light = is_dark(block) ? nullptr : pixels_.light(reader, block, pixel.place);
    if (light != nullptr) pixel.light = *light;
  }
  for (const BrightPixels::Pixel& pixel : rim_) {
    float darkest = pixel.light.luminance;
    // Pixels darker than the halo threshold hardly move the centroid.
    if (!(darkest >= dark)) continue;
    pixels_.for_each_neighbour(pixel.place, [&](Place p, PixelId id) {
      const std::size_t block = layout_.block_of(p.lens, p.x, p.y);
      if (is_dark(block)) {
        darkest = std::min(darkest, sums_->peak[block]);
        return;
      }
      const PixelLight* light = pixels_.light(reader, block, p);
      if (light != nullptr && pixels_.solid_angle({p, id, *light}) > 0) darkest = std::min(darkest, light->luminance);
    });
    if (darkest < 0.1F * peak) add(pixel, pixel.light.luminance - darkest);
  }
  return normalized(toward);
}

bool LightFinder::is_compact(float peak) const {
  if (flood_.blocks().size() <= compact_blocks_) return true;
  if (flood_.blocks().size() > pixels_.max_blocks()) return false;
  double sr = 0, luminance = 0;
  for (const std::uint32_t block : flood_.blocks()) {
    sr += grid_.solid_angle(block);
    luminance += std::max(0.0F, sums_->sum[block].luminance());
  }
  const double max_sr = static_cast<double>(kCompactPixels) * pixels_.mean_solid_angle();
  return sr <= max_sr || (flood_.blocks().size() <= kMaxHalfLitBlocks && luminance <= max_sr * peak);
}

void LightFinder::record_part(std::uint32_t block, const CellSum& light) {
  std::vector<DetectedLights::Part>& parts = found_.parts;
  if (parts.empty() || parts.back().block != block || parts.back().region != region_number_) {
    if (parts.size() == parts.capacity()) return;
    parts.push_back({block, region_number_, {}});
  }
  parts.back().light += light;
}

void LightFinder::gather_pixels(Vec3d axis, RegionMoments& out) {
  for (const BrightPixels::Pixel& pixel : region_) {
    const PixelLight& l = pixel.light;
    const double sr = pixels_.solid_angle(pixel), c = dot(vec_cast<double>(pixels_.direction(pixel)), axis);
    const auto a = static_cast<float>(sr);
    record_part(static_cast<std::uint32_t>(layout_.block_of(pixel.place.lens, pixel.place.x, pixel.place.y)),
                {l.r * a, l.g * a, l.b * a});
    out.add(l.r * sr, l.g * sr, l.b * sr, l.luminance * sr, c);
  }
}

void LightFinder::gather_blocks(float floor, Vec3d axis, RegionMoments& out) {
  for (const std::uint32_t block : flood_.blocks()) {
    const CellSum& s = sums_->sum[block];
    // Blocks that were processed pixel by pixel, or are too dark on average, are left to the harmonics.
    if (pixels_.has(block) || !(s.luminance() >= floor * grid_.solid_angle(block))) continue;
    owner_[block] = region_number_;
    owned_.push_back(block);
    const Vec3d d = vec_cast<double>(grid_.direction(block));
    const double c = dot(d, axis), luminance = s.luminance();
    out.toward += d * luminance;
    record_part(block, s);
    out.add(s.r, s.g, s.b, luminance, c);
  }
}

Light LightFinder::region_light(RowReader& reader, std::uint32_t block, Place peak_at, float peak, bool compact) {
  Light out;
  const float threshold = halo_threshold(peak);
  region_.clear();
  RegionMoments all;
  Vec3d axis;
  double variance = 0;
  std::size_t core = 0;
  if (compact) {
    claim(peak_at, pixels_.id(peak_at), pixels_.light(peak_at));
    // flood_ contains all blocks with a connected pixel of at least half the peak.
    grow_core(reader, 0.5F * peak);
    core = region_.size();
    axis = core_direction(reader, peak, threshold);
    if (axis == Vec3d{}) return out;
    double core_sr = 0;
    for (std::size_t k = 0; k < core; ++k) core_sr += pixels_.solid_angle(region_[k]);
    // Variance of the centroid of n square pixels: edge² / 12 / n, plus (a tenth of a pixel)² for light within pixels.
    const int shared = reader.pixels_per_color();
    const double samples = std::max(1.0, static_cast<double>(core) / shared);
    variance = core_sr / static_cast<double>(core) * shared * (1.0 / 12 / samples + 0.01);
    if (shared > 1 && !reader.has_luma()) variance *= kMosaicCentroidError * kMosaicCentroidError;
    const Vec3f middle = vec_cast<float>(axis);
    (void)flood(block, threshold, middle, kCosHaloReachOfBlocks);
    if (is_compact(peak)) {
      grow_halo(reader, threshold, middle);
    } else {
      // Pixel by pixel in the blocks of the core, by whole blocks beyond.
      (void)flood(block, 0.5F * peak, {}, BlockFloodFill::kUnlimitedReach);
      grow_halo(reader, threshold, middle);
      (void)flood(block, threshold, middle, kCosHaloReach);
      gather_blocks(threshold, axis, all);
    }
  } else {
    // Determines the axis from the blocks first, then their moments about it.
    RegionMoments first;
    const std::size_t owned = owned_.size();
    gather_blocks(0.5F * peak, vec_cast<double>(grid_.direction(block)), first);
    axis = normalized(first.toward);
    if (axis == Vec3d{}) return out;
    for (std::size_t k = owned; k < owned_.size(); ++k) owner_[owned_[k]] = 0;
    owned_.resize(owned);
    while (!found_.parts.empty() && found_.parts.back().region == region_number_) found_.parts.pop_back();
    gather_blocks(0.5F * peak, axis, all);
    // Blocks determine the direction to a tenth of their side.
    variance = grid_.solid_angle(block) * 0.01;
  }
  gather_pixels(axis, all);
  if (const int shared = reader.pixels_per_color(); compact && shared > 1) {
    const double samples = static_cast<double>(core) / shared;
    chroma_edge_error2_ += std::pow(reader.has_luma() ? chroma_edge_error(all.irradiance, samples, scene_)
                                                      : mosaic_edge_error(all.irradiance, samples),
                                    2);
  }
  out.direction = vec_cast<float>(axis);
  out.irradiance = {static_cast<float>(all.irradiance[0]), static_cast<float>(all.irradiance[1]),
                    static_cast<float>(all.irradiance[2])};
  out.angular_radius_rad = all.weight > 0 ? static_cast<float>(cap_radius(all.spread / all.weight)) : 0;
  out.direction_covariance = {static_cast<float>(variance), 0, static_cast<float>(variance)};
  return out;
}

std::optional<Light> LightFinder::next_region(RowReader& reader, double least) {
  while (region_number_ < kMaxRegions && !candidates_.empty()) {
    std::pop_heap(candidates_.begin(), candidates_.end());
    const Candidate c = candidates_.back();
    candidates_.pop_back();
    if (owner_[c.block] != 0 || rejected_in_frame_[c.block] == frame_number_) continue;

    parent_ = 0;
    // Reads no pixel if the light of all blocks within reach, above their surroundings, is too little.
    if (least > 0 && flood(c.block, halo_threshold(c.peak), grid_.direction(c.block), kCosMaxExtent) < least) {
      // Except for light below this halo threshold, the other blocks of the flood reach no more.
      for (const std::uint32_t block : flood_.blocks()) rejected_in_frame_[block] = frame_number_;
      continue;
    }

    (void)flood(c.block, 0.5F * c.peak, {}, BlockFloodFill::kUnlimitedReach);
    bool compact = is_compact(c.peak);
    Place peak_at{};
    float peak = c.peak;
    if (compact) {
      pixels_.read(reader, c.block);
      compact = pixels_.has(c.block);
    }
    if (compact) {
      // The block's peak is an upper bound: where its remaining pixels are darker, it is queued again with their peak.
      peak_at = peak_pixel(c.block, peak);
      if (peak < min_peak_) continue;
      if (!candidates_.empty() && peak < candidates_.front().peak && peak < c.peak) {
        candidates_.push_back({peak, c.block});
        std::push_heap(candidates_.begin(), candidates_.end());
        continue;
      }
      if (peak < c.peak) {
        (void)flood(c.block, 0.5F * peak, {}, BlockFloodFill::kUnlimitedReach);
        compact = is_compact(peak);
      }
    }
    ++region_number_;
    const Light light = region_light(reader, c.block, peak_at, peak, compact);
    region_irradiance_[region_number_] = light.irradiance.luminance();
    if (region_irradiance_[region_number_] > 0) return light;
  }
  return std::nullopt;
}

const DetectedLights& LightFinder::find_brightest(RowReader& reader, const FrameIntegral& integral,
                                                  const EstimatorConfig& config) {
  for (const PixelId id : claimed_pixels_) claimed_[id] = 0;
  claimed_pixels_.clear();
  for (const std::uint32_t block : owned_) owner_[block] = 0;
  owned_.clear();
  pixels_.clear();
  ++frame_number_;
  candidates_.clear();
  found_.clear();
  chroma_edge_error2_ = 0;
  region_number_ = 0;
  brightest_.reset();
  sums_ = &integral.blocks;
  mean_ = integral.mean_luminance;
  if (!(mean_ > 0) || !std::isfinite(mean_) || config.max_lights == 0) return found_;

  // The colour of the observed blocks: of two lenses, one may be missing.
  const int last = layout_.lens_count() - 1;
  const std::size_t begin = reader.has(0) ? 0 : layout_.first(last);
  scene_ = std::span(sums_->sum).first(reader.has(last) ? layout_.size() : layout_.first(last)).subspan(begin);
  min_peak_ = static_cast<float>(config.panorama.light_threshold) * mean_;
  const double min_share = config.panorama.radiance_epsilon > 0
                               ? kMinIrradianceFraction
                               : std::max(kMinIrradianceFraction, kMinFractionOfEpsilon * config.panorama.epsilon);
  min_irradiance_ = min_share * mean_ * grid_.covered_sr();
  // Most groups of blocks hold no candidate.
  const std::vector<float>& peaks = sums_->peak;
  constexpr std::size_t kGroup = 16;
  for (std::size_t first = 0; first < peaks.size(); first += kGroup) {
    const std::size_t end = std::min(first + kGroup, peaks.size());
    int count = 0;
    for (std::size_t block = first; block < end; ++block) count += peaks[block] >= min_peak_ ? 1 : 0;
    for (std::size_t block = first; count > 0 && block < end; ++block)
      if (peaks[block] >= min_peak_) candidates_.push_back({peaks[block], static_cast<std::uint32_t>(block)});
  }
  std::make_heap(candidates_.begin(), candidates_.end());
  const float peak = candidates_.empty() ? 0 : candidates_.front().peak;
  // The brightest light has no lower limit of irradiance.
  brightest_ = next_region(reader, 0);
  brightest_region_ = region_number_;
  found_.chroma_edge_error = std::sqrt(chroma_edge_error2_);
  if (brightest_ && brightest_->angular_radius_rad > kMaxAngularRadius) brightest_.reset();
  if (!brightest_) return found_;
  found_.lights.push_back(*brightest_);
  found_.region.push_back(brightest_region_);
  found_.required = peak > kMinPeakRatio * mean_ ? 0 : -1;
  return found_;
}

const DetectedLights& LightFinder::find_others(RowReader& reader, int max_lights) {
  std::vector<Light>& lights = found_.lights;
  lights.clear();
  found_.region.clear();
  // The colour of all blocks, filled ones included.
  scene_ = sums_->sum;
  const auto stronger = [](const Light& a, const Light& b) {
    return a.irradiance.luminance() > b.irradiance.luminance();
  };
  const auto add = [&](const Light& light, std::uint8_t number) {
    const auto at = std::upper_bound(lights.begin(), lights.end(), light, stronger);
    found_.region.insert(found_.region.begin() + (at - lights.begin()), number);
    lights.insert(at, light);
  };
  // Number of lights in addition to the brightest.
  const auto capacity = static_cast<std::size_t>(std::max(max_lights, 0)) - (brightest_ && max_lights > 0 ? 1 : 0);
  const auto threshold = [&] {
    return lights.size() < capacity
               ? min_irradiance_
               : std::max(min_irradiance_, kReplacementRatio * lights.back().irradiance.luminance());
  };
  while (capacity > 0) {
    const std::optional<Light> light = next_region(reader, threshold());
    if (!light) break;
    const float luminance = light->irradiance.luminance();
    if (luminance < min_irradiance_ || (parent_ != 0 && luminance < kHaloFraction * region_irradiance_[parent_]))
      continue;
    if (light->angular_radius_rad > kMaxAngularRadius) continue;
    if (lights.size() == capacity) {
      if (!stronger(*light, lights.back())) continue;
      lights.pop_back();
      found_.region.pop_back();
    }
    add(*light, region_number_);
  }
  found_.chroma_edge_error = std::sqrt(chroma_edge_error2_);
  const bool required = found_.required >= 0;
  found_.required = -1;
  if (!brightest_ || max_lights <= 0) return found_;
  add(*brightest_, brightest_region_);
  if (required)
    found_.required = static_cast<int>(std::find(found_.region.begin(), found_.region.end(), brightest_region_) -
                                       found_.region.begin());
  return found_;
}

}  // namespace lightwell::estimate
