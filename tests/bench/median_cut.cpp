#include "bench/median_cut.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lightwell::bench {

namespace {

/// Columns i0..i1-1 of rows j0..j1-1.
struct Region {
  int i0 = 0, i1 = 0, j0 = 0, j1 = 0;
};

/// Summed-area table (Crow 1984) of luminance times solid angle.
class EnergyTable {
 public:
  explicit EnergyTable(const EquirectImage& image)
      : row_(static_cast<std::size_t>(image.width) + 1), sums_(row_ * (static_cast<std::size_t>(image.height) + 1)) {
    const float* at = image.rgb.data();
    for (int j = 0; j < image.height; ++j) {
      const double omega = equirect_solid_angle(j, image.width, image.height);
      double row = 0;
      const double* above = sums_.data() + row_ * static_cast<std::size_t>(j) + 1;
      double* here = sums_.data() + row_ * (static_cast<std::size_t>(j) + 1) + 1;
      for (int i = 0; i < image.width; ++i, at += 3) {
        row += omega * (0.2126 * at[0] + 0.7152 * at[1] + 0.0722 * at[2]);
        here[i] = above[i] + row;
      }
    }
  }

  [[nodiscard]] double energy(const Region& r) const {
    return sum(r.i1, r.j1) - sum(r.i0, r.j1) - sum(r.i1, r.j0) + sum(r.i0, r.j0);
  }

 private:
  [[nodiscard]] double sum(int i, int j) const {
    return sums_[row_ * static_cast<std::size_t>(j) + static_cast<std::size_t>(i)];
  }

  std::size_t row_;
  std::vector<double> sums_;
};

/// Cuts a region along one side, at the position in `from`..`to` that halves its energy best.
template <typename FirstPart>
int best_cut(int from, int to, double half, const EnergyTable& table, FirstPart first_part) {
  int low = from, high = to;  // the first cut whose first part has at least half, if any
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (table.energy(first_part(middle)) < half)
      low = middle + 1;
    else
      high = middle;
  }
  if (low > from && half - table.energy(first_part(low - 1)) < table.energy(first_part(low)) - half) --low;
  return low;
}

/// Replaces a region by its two parts; false if it is one pixel.
bool cut(const Region& r, const EquirectImage& image, const EnergyTable& table, std::vector<Region>& parts) {
  const int columns = r.i1 - r.i0, rows = r.j1 - r.j0;
  if (columns * rows <= 1) return false;
  const double latitude = std::numbers::pi * (0.5 - 0.5 * (r.j0 + r.j1) / image.height);
  const double width = 2.0 * columns / image.width * std::cos(latitude),
               height = static_cast<double>(rows) / image.height;
  const double half = 0.5 * table.energy(r);
  if (rows == 1 || (columns > 1 && width > height)) {
    const auto left = [&](int i) { return Region{r.i0, i, r.j0, r.j1}; };
    const int at = best_cut(r.i0 + 1, r.i1 - 1, half, table, left);
    parts.push_back(left(at));
    parts.push_back({at, r.i1, r.j0, r.j1});
  } else {
    const auto top = [&](int j) { return Region{r.i0, r.i1, r.j0, j}; };
    const int at = best_cut(r.j0 + 1, r.j1 - 1, half, table, top);
    parts.push_back(top(at));
    parts.push_back({r.i0, r.i1, at, r.j1});
  }
  return true;
}

/// Sine and cosine of every column's longitude.
struct Columns {
  std::vector<double> sine, cosine;

  explicit Columns(int width) {
    for (int i = 0; i < width; ++i) {
      const double phi = 2 * std::numbers::pi * ((i + 0.5) / width - 0.5);
      sine.push_back(std::sin(phi));
      cosine.push_back(std::cos(phi));
    }
  }
};

CutLight light_of(const Region& r, const EquirectImage& image, const Columns& columns) {
  CutLight light;
  Triple centroid{};
  for (int j = r.j0; j < r.j1; ++j) {
    const double omega = equirect_solid_angle(j, image.width, image.height);
    const double theta = std::numbers::pi * (0.5 - (j + 0.5) / image.height);
    double energy = 0, sine = 0, cosine = 0;
    Triple row{};
    const float* at = image.rgb.data() + 3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) +
                                              static_cast<std::size_t>(r.i0));
    for (auto i = static_cast<std::size_t>(r.i0); i < static_cast<std::size_t>(r.i1); ++i, at += 3) {
      for (std::size_t c = 0; c < 3; ++c) row[c] += at[c];
      const double e = 0.2126 * at[0] + 0.7152 * at[1] + 0.0722 * at[2];
      energy += e;
      sine += e * columns.sine[i];
      cosine += e * columns.cosine[i];
    }
    for (std::size_t c = 0; c < 3; ++c) light.irradiance[c] += omega * row[c];
    centroid[0] += omega * std::cos(theta) * sine;
    centroid[1] += omega * std::sin(theta) * energy;
    centroid[2] -= omega * std::cos(theta) * cosine;
    light.solid_angle_sr += omega * (r.i1 - r.i0);
  }
  const double length = std::hypot(centroid[0], centroid[1], centroid[2]);
  if (length > 0)
    light.direction = {centroid[0] / length, centroid[1] / length, centroid[2] / length};
  else
    light.direction = equirect_direction(0.5 * (r.i0 + r.i1), 0.5 * (r.j0 + r.j1), image.width, image.height);
  return light;
}

}  // namespace

std::vector<CutLight> median_cut(const EquirectImage& image, int generations) {
  if (image.width < 1 || image.height < 1) return {};
  const EnergyTable table(image);
  std::vector<Region> regions{{0, image.width, 0, image.height}};
  for (int g = 0; g < generations; ++g) {
    std::vector<Region> parts;
    for (const Region& r : regions) {
      if (!cut(r, image, table, parts)) parts.push_back(r);
    }
    regions = std::move(parts);
  }
  const Columns columns(image.width);
  std::vector<CutLight> lights;
  for (const Region& r : regions) lights.push_back(light_of(r, image, columns));
  return lights;
}

Triple irradiance_of(const std::vector<CutLight>& lights, const Triple& normal) {
  Triple sum{};
  for (const CutLight& l : lights) {
    const double cosine =
        std::max(0.0, normal[0] * l.direction[0] + normal[1] * l.direction[1] + normal[2] * l.direction[2]);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += cosine * l.irradiance[c];
  }
  return sum;
}

}  // namespace lightwell::bench
