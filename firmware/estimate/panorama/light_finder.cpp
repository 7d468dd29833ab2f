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

void LightFinder::claim(PixelPlace place, PixelId id) {
  claimed_[id] = 1;
  region_.push_back({place, id});
  all_claimed_.push_back(id);
}

void LightFinder::grow(RowReader& reader, float floor, Vec3f axis, float cos_reach) {
  for (std::size_t next = 0; next < region_.size(); ++next) {
    for_neighbours(region_[next].place, [&](PixelPlace p, PixelId id) {
      if (claimed_[id] != 0 || all_claimed_.size() + 1 >= all_claimed_.capacity()) return;
      const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
      const auto i = id - lens_first_[static_cast<std::size_t>(p.lens)];
      if (!(lens.solid_angle[i] > 0) || dot(lens.direction[i], axis) < cos_reach) return;
      if (light_of(reader, p).luminance >= floor) claim(p, id);
    });
  }
}

Light LightFinder::measure(RowReader& reader, std::size_t core) {
  Vec3d toward;
  double core_sr = 0;
  const auto visit = [&](std::size_t from, std::size_t to, auto&& f) {
    for (std::size_t k = from; k < to; ++k) {
      const PixelPlace p = region_[k].place;
      const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
      const auto i = region_[k].id - lens_first_[static_cast<std::size_t>(p.lens)];
      f(light_of(reader, p), vec_cast<double>(lens.direction[i]), static_cast<double>(lens.solid_angle[i]));
    }
  };
  visit(0, core, [&](const PixelLight& l, Vec3d d, double sr) {
    toward += d * (l.luminance * sr);
    core_sr += sr;
  });
  Light out;
  const Vec3d axis = normalized(toward);
  out.direction = vec_cast<float>(axis);
  double irradiance[3] = {}, weight = 0, spread = 0;
  visit(0, region_.size(), [&](const PixelLight& l, Vec3d d, double sr) {
    const double c = dot(d, axis);
    irradiance[0] += l.r * sr * c;
    irradiance[1] += l.g * sr * c;
    irradiance[2] += l.b * sr * c;
    weight += l.luminance * sr;
    spread += l.luminance * sr * (1 - c);
  });
  out.irradiance = {static_cast<float>(irradiance[0]), static_cast<float>(irradiance[1]),
                    static_cast<float>(irradiance[2])};
  out.angular_radius_rad = weight > 0 ? static_cast<float>(cap_radius(spread / weight)) : 0;
  // The centroid of n square pixels of known edges: each tells a position to edge/sqrt(12), and a tenth of a pixel is
  // lost to what pixels do not tell of the light within them.
  const double pixel_sr = core_sr / static_cast<double>(std::max<std::size_t>(core, 1));
  const auto variance = static_cast<float>(pixel_sr * (1.0 / 12 / static_cast<double>(std::max<std::size_t>(core, 1)) + 0.01));
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
    PixelPlace peak_at{};
    float peak = 0;
    for (int y = p.y; y < p.y + p.height; ++y) {
      for (int x = p.x; x < p.x + p.width; ++x) {
        if (claimed_[id_of(p.lens, x, y)] != 0) continue;
        if (const float l = light_of(reader, {p.lens, x, y}).luminance; l > peak) {
          peak = l;
          peak_at = {p.lens, x, y};
        }
      }
    }
    if (peak < floor) continue;
    if (!candidates_.empty() && peak < candidates_.front().peak && peak < c.peak) {
      candidates_.push_back({peak, c.block});
      std::push_heap(candidates_.begin(), candidates_.end());
      continue;
    }

    ++regions;
    region_.clear();
    claim(peak_at, id_of(peak_at.lens, peak_at.x, peak_at.y));
    grow(reader, 0.5F * peak, {}, -2);
    const std::size_t core = region_.size();
    const Light seen = measure(reader, core);
    if (seen.direction == Vec3f{}) continue;
    grow(reader, std::max(kSkirt * peak, kSkirtOverMean * mean_luminance), seen.direction, kCosReach);
    const Light light = measure(reader, core);
    if (first_region) {
      // The brightest region is a light however little it gives: people look for it.
      brightest = light;
      first_region = false;
    } else if (light.irradiance.luminance() < faintest) {
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
