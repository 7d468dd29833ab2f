#include "estimate/panorama/light_finder.hpp"

#include <algorithm>
#include <cmath>
#include <lightwell/cap.hpp>
#include <numbers>

namespace lightwell::estimate {
namespace {

/// Energy is gathered down to this share of the peak, and to kSkirtOverMean times the mean.
constexpr float kSkirt = 0.02F;
constexpr float kSkirtOverMean = 3;
/// And no further from the centroid than this: a glow that wide is better left to the harmonics.
const float kCosReach = std::cos(12 * std::numbers::pi_v<float> / 180);
/// A wider region is no light that casts a shadow.
constexpr float kWidest = 0.6F;
/// A light that gives less of all light than this is left to the harmonics: it could not change a figure of the answer.
constexpr double kFaintest = 0.002;
/// Peaks looked at a frame; a sky of a thousand lamps must not cost a thousand regions.
constexpr int kMostRegions = 96;
/// A region that touches an earlier one and has less than this share of its light is the rest of that one's glow.
constexpr float kGlow = 0.1F;
constexpr std::size_t kMostSlots = 4096;
constexpr std::size_t kMostRegionPixels = 400'000;
/// A block whose peak is so many times its mean does not hold its light evenly.
constexpr float kUneven = 2;

int widest(const RigTable& table) {
  int w = 0;
  for (const LensTable& lens : table.lenses) w = std::max(w, lens.width);
  return w;
}

}  // namespace

LightFinder::LightFinder(const RigTable& table, const BlockLayout& layout)
    : table_(table), layout_(layout), row_(widest(table)), slots_(std::min(kMostSlots, layout.size())) {
  PixelId pixels = 0;
  for (const LensTable& lens : table.lenses) {
    lens_first_.push_back(pixels);
    pixels += static_cast<PixelId>(lens.width) * static_cast<PixelId>(lens.height);
  }
  lens_first_.push_back(pixels);
  claimed_.resize(pixels);
  region_.reserve(std::min<std::size_t>(pixels, kMostRegionPixels) + 16);
  all_claimed_.reserve(region_.capacity());
  candidates_.reserve(layout.size() + 1);
  region_irradiance_.resize(kMostRegions + 1);
  slot_of_block_.assign(layout.size(), -1);
  loaded_.reserve(slots_);
  pool_.resize(slots_ * static_cast<std::size_t>(layout.edge()) * static_cast<std::size_t>(layout.edge()));
}

LightFinder::PixelId LightFinder::id_of(int lens, int x, int y) const {
  const int width = table_.lenses[static_cast<std::size_t>(lens)].width;
  return lens_first_[static_cast<std::size_t>(lens)] + static_cast<PixelId>(y) * static_cast<PixelId>(width) +
         static_cast<PixelId>(x);
}

void LightFinder::load(RowReader& reader, std::uint32_t block) {
  if (slot_of_block_[block] >= 0 || loaded_.size() >= slots_) return;
  const auto edge = static_cast<std::size_t>(layout_.edge());
  const std::size_t slot = loaded_.size();
  slot_of_block_[block] = static_cast<std::int32_t>(slot);
  loaded_.push_back(block);
  const BlockLayout::Place p = layout_.place(block);
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
  ReadingCounts ignored;  // The pass over all pixels has counted these already.
  for (int y = 0; y < p.height; ++y) {
    reader.read(p.lens, p.y + y, p.x, p.x + p.width, row_, ignored);
    const std::size_t at = static_cast<std::size_t>(p.y + y) * static_cast<std::size_t>(lens.width) +
                           static_cast<std::size_t>(p.x);
    for (int x = 0; x < p.width; ++x) {
      const auto i = static_cast<std::size_t>(x);
      PixelLight& out = pool_[(slot * edge + static_cast<std::size_t>(y)) * edge + i];
      out = {};
      if (!(lens.solid_angle[at + i] > 0)) continue;
      out = {row_.r[i], row_.g[i], row_.b[i], 0.2126F * row_.r[i] + 0.7152F * row_.g[i] + 0.0722F * row_.b[i]};
    }
  }
}

LightFinder::PixelLight LightFinder::light_of(RowReader& reader, PixelPlace p) {
  const std::size_t block = layout_.block_of(p.lens, p.x, p.y);
  if (slot_of_block_[block] < 0) load(reader, static_cast<std::uint32_t>(block));
  const std::int32_t slot = slot_of_block_[block];
  if (slot < 0) return {};
  const int mask = layout_.edge() - 1, shift = layout_.shift();
  return pool_[static_cast<std::size_t>(((slot << shift | (p.y & mask)) << shift) | (p.x & mask))];
}

template <class Visit>
void LightFinder::for_neighbours(PixelPlace p, Visit&& visit) const {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      int x = p.x + dx, y = p.y + dy;
      if (lens.equirectangular) {
        if (y < 0 || y >= lens.height) {
          // Across the pole lies the same row, half a turn on.
          y = p.y;
          x += lens.width / 2;
        }
        x = (x % lens.width + lens.width) % lens.width;
      } else if (x < 0 || y < 0 || x >= lens.width || y >= lens.height) {
        continue;
      }
      visit(PixelPlace{p.lens, x, y}, id_of(p.lens, x, y));
    }
  }
  if (lens.twin.empty()) return;
  const std::int32_t twin = lens.twin[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(lens.width) +
                                      static_cast<std::size_t>(p.x)];
  if (twin < 0) return;
  const int other = 1 - p.lens, other_width = table_.lenses[static_cast<std::size_t>(other)].width;
  visit(PixelPlace{other, twin % other_width, twin / other_width},
        lens_first_[static_cast<std::size_t>(other)] + static_cast<PixelId>(twin));
}

void LightFinder::claim(PixelPlace place, PixelId id, const PixelLight& light) {
  claimed_[id] = number_;
  region_.push_back({place, id, light});
  all_claimed_.push_back(id);
}

void LightFinder::grow(RowReader& reader, float floor, Vec3f axis, float cos_reach) {
  for (std::size_t next = 0; next < region_.size(); ++next) {
    for_neighbours(region_[next].place, [&](PixelPlace p, PixelId id) {
      if (const std::uint8_t other = claimed_[id]; other != 0) {
        if (other != number_ && (parent_ == 0 || region_irradiance_[other] > region_irradiance_[parent_])) parent_ = other;
        return;
      }
      if (all_claimed_.size() + 1 >= all_claimed_.capacity()) return;
      const PixelLight light = light_of(reader, p);
      if (light.luminance < floor) return;
      const RegionPixel pixel{p, id, light};
      if (solid_angle(pixel) > 0 && dot(direction(pixel), axis) >= cos_reach) claim(p, id, light);
    });
  }
}

Vec3f LightFinder::direction(const RegionPixel& pixel) const {
  const auto lens = static_cast<std::size_t>(pixel.place.lens);
  return table_.lenses[lens].direction[pixel.id - lens_first_[lens]];
}

float LightFinder::solid_angle(const RegionPixel& pixel) const {
  const auto lens = static_cast<std::size_t>(pixel.place.lens);
  return table_.lenses[lens].solid_angle[pixel.id - lens_first_[lens]];
}

Vec3d LightFinder::core_direction(std::size_t core) const {
  Vec3d toward;
  for (std::size_t k = 0; k < core; ++k)
    toward += vec_cast<double>(direction(region_[k])) * (static_cast<double>(region_[k].light.luminance) * solid_angle(region_[k]));
  return normalized(toward);
}

Light LightFinder::measure(std::size_t core, Vec3d axis, int pixels_per_color) const {
  double irradiance[3] = {}, weight = 0, spread = 0, core_sr = 0;
  for (std::size_t k = 0; k < region_.size(); ++k) {
    const PixelLight& l = region_[k].light;
    const double sr = solid_angle(region_[k]), c = dot(vec_cast<double>(direction(region_[k])), axis);
    irradiance[0] += l.r * sr * c;
    irradiance[1] += l.g * sr * c;
    irradiance[2] += l.b * sr * c;
    weight += l.luminance * sr;
    spread += l.luminance * sr * (1 - c);
    if (k < core) core_sr += sr;
  }
  Light out;
  out.direction = vec_cast<float>(axis);
  out.irradiance = {static_cast<float>(irradiance[0]), static_cast<float>(irradiance[1]),
                    static_cast<float>(irradiance[2])};
  out.angular_radius_rad = weight > 0 ? static_cast<float>(cap_radius(spread / weight)) : 0;
  // The centroid of n square pixels of known edges: each tells a position to edge/sqrt(12), and a tenth of a pixel is
  // lost to what pixels do not tell of the light within them.
  const double sample_sr = core_sr / static_cast<double>(core) * pixels_per_color;
  const double samples = std::max(1.0, static_cast<double>(core) / pixels_per_color);
  const auto variance = static_cast<float>(sample_sr * (1.0 / 12 / samples + 0.01));
  out.direction_covariance = {variance, 0, variance};
  return out;
}

void LightFinder::centroids(const BlockSums& sums, const CellGrid& grid, std::vector<CellGrid::Moved>& moved) const {
  const auto edge = static_cast<std::size_t>(layout_.edge());
  for (std::size_t slot = 0; slot < loaded_.size(); ++slot) {
    const std::uint32_t block = loaded_[slot];
    if (!(sums.peak[block] * grid.solid_angle(block) > kUneven * sums.sum[block].luminance())) continue;
    const BlockLayout::Place p = layout_.place(block);
    const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
    Vec3d toward;
    for (int y = 0; y < p.height; ++y) {
      for (int x = 0; x < p.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(p.y + y) * static_cast<std::size_t>(lens.width) +
                              static_cast<std::size_t>(p.x + x);
        const PixelLight& l = pool_[(slot * edge + static_cast<std::size_t>(y)) * edge + static_cast<std::size_t>(x)];
        toward += vec_cast<double>(lens.direction[i]) * static_cast<double>(l.luminance * lens.solid_angle[i]);
      }
    }
    if (const Vec3d d = normalized(toward); !(d == Vec3d{})) moved.push_back({block, d});
  }
  std::sort(moved.begin(), moved.end(), [](const auto& a, const auto& b) { return a.cell < b.cell; });
}

void LightFinder::find(RowReader& reader, const BlockSums& sums, const CellGrid& grid, float mean_luminance,
                       const EstimatorConfig& config, std::vector<Light>& lights,
                       std::vector<CellGrid::Moved>& moved) {
  for (const PixelId id : all_claimed_) claimed_[id] = 0;
  all_claimed_.clear();
  for (const std::uint32_t block : loaded_) slot_of_block_[block] = -1;
  loaded_.clear();
  candidates_.clear();
  lights.clear();
  moved.clear();
  if (!(mean_luminance > 0) || !std::isfinite(mean_luminance)) return;

  const auto floor = static_cast<float>(config.light_threshold) * mean_luminance;
  for (std::size_t block = 0; block < sums.peak.size(); ++block)
    if (sums.peak[block] >= floor) candidates_.push_back({sums.peak[block], static_cast<std::uint32_t>(block)});
  std::make_heap(candidates_.begin(), candidates_.end());

  const double faintest = kFaintest * mean_luminance * grid.covered_sr();
  const auto most = static_cast<std::size_t>(config.max_lights);
  const auto stronger = [](const Light& a, const Light& b) { return a.irradiance.luminance() > b.irradiance.luminance(); };
  Light brightest;
  bool first_region = true;
  for (int regions = 0; regions < kMostRegions && !candidates_.empty() && most > 0;) {
    std::pop_heap(candidates_.begin(), candidates_.end());
    Candidate c = candidates_.back();
    candidates_.pop_back();
    load(reader, c.block);
    // What is left of this block may be darker than when the block was queued: then it waits its turn again.
    const BlockLayout::Place p = layout_.place(c.block);
    RegionPixel peak_at{};
    float peak = 0;
    for (int y = p.y; y < p.y + p.height; ++y) {
      for (int x = p.x; x < p.x + p.width; ++x) {
        if (claimed_[id_of(p.lens, x, y)] != 0) continue;
        if (const PixelLight l = light_of(reader, {p.lens, x, y}); l.luminance > peak) {
          peak = l.luminance;
          peak_at = {{p.lens, x, y}, id_of(p.lens, x, y), l};
        }
      }
    }
    if (peak < floor) continue;
    if (!candidates_.empty() && peak < candidates_.front().peak && peak < c.peak) {
      candidates_.push_back({peak, c.block});
      std::push_heap(candidates_.begin(), candidates_.end());
      continue;
    }

    number_ = static_cast<std::uint8_t>(++regions);
    parent_ = 0;
    region_irradiance_[number_] = 0;
    region_.clear();
    claim(peak_at.place, peak_at.id, peak_at.light);
    grow(reader, 0.5F * peak, {}, -2);
    const std::size_t core = region_.size();
    const Vec3d axis = core_direction(core);
    if (axis == Vec3d{}) continue;
    grow(reader, std::max(kSkirt * peak, kSkirtOverMean * mean_luminance), vec_cast<float>(axis), kCosReach);
    const Light light = measure(core, axis, reader.pixels_per_color());
    region_irradiance_[number_] = light.irradiance.luminance();
    if (first_region) {
      // The brightest region is a light however little it gives: people look for it.
      brightest = light;
      first_region = false;
    } else if (light.irradiance.luminance() < faintest ||
               (parent_ != 0 && light.irradiance.luminance() < kGlow * region_irradiance_[parent_])) {
      continue;
    }
    if (light.angular_radius_rad > kWidest) continue;
    if (lights.size() >= most) {
      if (!stronger(light, lights.back())) continue;
      lights.pop_back();
    }
    lights.insert(std::upper_bound(lights.begin(), lights.end(), light, stronger), light);
  }
  if (!first_region && brightest.angular_radius_rad <= kWidest && !lights.empty() &&
      std::none_of(lights.begin(), lights.end(), [&](const Light& l) { return l == brightest; }))
    lights.back() = brightest;

  // Bright blocks beside no region, strongest first, as far as the room goes.
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) { return b < a; });
  for (const Candidate& c : candidates_) load(reader, c.block);
  centroids(sums, grid, moved);
}

}  // namespace lightwell::estimate
