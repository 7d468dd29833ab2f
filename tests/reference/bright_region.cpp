#include "reference/bright_region.hpp"

#include <algorithm>
#include <cmath>

#include "reference/cap.hpp"

namespace lightwell::reference {

namespace {

struct Place {
  int i = 0, j = 0;
};

std::vector<Place> neighbours(const Place& at, int width, int height) {
  std::vector<Place> found;
  const auto add = [&](int i, int j) { found.push_back({((i % width) + width) % width, j}); };
  for (int dj = -1; dj <= 1; ++dj) {
    const int j = at.j + dj;
    if (j >= 0 && j < height) {
      for (int di = -1; di <= 1; ++di) add(at.i + di, j);
    } else if (width % 2 == 0) {
      for (int di = -1; di <= 1; ++di) add(at.i + width / 2 + di, at.j);
    } else {
      add(at.i + width / 2, at.j);
      add(at.i + width / 2 + 1, at.j);
    }
  }
  return found;
}

std::size_t index_of(const Place& at, int width) {
  return static_cast<std::size_t>(at.j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(at.i);
}

Place place_of(std::size_t index, int width) {
  const auto w = static_cast<std::size_t>(width);
  return {static_cast<int>(index % w), static_cast<int>(index / w)};
}

std::vector<double> luminances(const Panorama& p) {
  std::vector<double> y;
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) y.push_back(luminance(pixel(p, i, j)));
  }
  return y;
}

/// The pixels of the region about `peak`, ascending.
std::vector<std::size_t> connected(const std::vector<double>& y, std::size_t peak, int width, int height) {
  const double threshold = 0.5 * y[peak];
  std::vector<bool> seen(y.size());
  std::vector<std::size_t> found;
  std::vector<Place> open{place_of(peak, width)};
  seen[peak] = true;
  while (!open.empty()) {
    const Place at = open.back();
    open.pop_back();
    found.push_back(index_of(at, width));
    for (const Place& next : neighbours(at, width, height)) {
      const std::size_t index = index_of(next, width);
      if (seen[index] || y[index] < threshold) continue;
      seen[index] = true;
      open.push_back(next);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Computes direction, irradiance and sizes of region.pixels; `peak` is the direction if the sum cancels.
void measure(BrightRegion& region, const Panorama& p, const std::vector<double>& y, std::size_t peak) {
  const auto direction_of = [&](std::size_t index) {
    const Place at = place_of(index, p.width);
    return pixel_direction(at.i, at.j, p.width, p.height);
  };
  V3 sum{};
  double power = 0;
  for (const std::size_t index : region.pixels) {
    const int row = place_of(index, p.width).j;
    const double share = y[index] * pixel_solid_angle(row, p.width, p.height);
    sum = sum + share * direction_of(index);
    power += share;
  }
  // If the directions cancel, only rounding errors remain.
  const bool cancelled = length(sum) <= 1e-12 * power;
  region.direction = cancelled ? direction_of(peak) : normalised(sum);

  double moment = 0;
  for (const std::size_t index : region.pixels) {
    const Place at = place_of(index, p.width);
    const double solid_angle = pixel_solid_angle(at.j, p.width, p.height);
    const V3 d = direction_of(index);
    const V3 chord = d - region.direction;
    const Rgb radiance = pixel(p, at.i, at.j);
    for (std::size_t c = 0; c < 3; ++c) {
      region.radiance_integral[c] += radiance[c] * solid_angle;
      region.vector_irradiance[c] += radiance[c] * solid_angle * dot(d, region.direction);
    }
    region.solid_angle_sr += solid_angle;
    moment += y[index] * solid_angle * 0.5 * dot(chord, chord);
  }
  region.angular_radius_rad = cap_radius_from_mean_versine(moment / power);
  region.solid_angle_radius_rad = cap_radius_from_mean_versine(region.solid_angle_sr / (4 * pi));
}

}  // namespace

std::optional<BrightRegion> bright_region(const Panorama& p) {
  std::vector<BrightRegion> regions = bright_regions(p, 1);
  if (regions.empty()) return std::nullopt;
  return regions.front();
}

std::vector<BrightRegion> bright_regions(const Panorama& p, int count) {
  const Panorama image = cleaned(p);
  const double mean = luminance(mean_radiance(image));
  std::vector<double> y = luminances(image);
  std::vector<BrightRegion> regions;
  while (static_cast<int>(regions.size()) < count && !y.empty()) {
    const auto brightest = std::max_element(y.begin(), y.end());
    const auto peak = static_cast<std::size_t>(brightest - y.begin());
    if (!(y[peak] > 0)) break;
    BrightRegion region;
    region.peak_luminance = y[peak];
    region.peak_to_mean = y[peak] / mean;
    region.pixels = connected(y, peak, p.width, p.height);
    measure(region, image, y, peak);
    for (const std::size_t index : region.pixels) y[index] = 0;
    regions.push_back(region);
  }
  return regions;
}

}  // namespace lightwell::reference
