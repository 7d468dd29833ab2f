#include "bench/ar_output.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace lightwell::bench {

namespace {

constexpr double kPi = std::numbers::pi;

std::array<double, 9> basis(const Triple& d) {
  const auto [x, y, z] = d;
  return {0.28209479177387814,
          0.4886025119029199 * y,
          0.4886025119029199 * z,
          0.4886025119029199 * x,
          1.0925484305920792 * x * y,
          1.0925484305920792 * y * z,
          0.31539156525252005 * (3 * z * z - 1),
          1.0925484305920792 * x * z,
          0.5462742152960396 * (x * x - y * y)};
}

double luminance(const float* rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

const float* pixel(const EquirectImage& image, std::size_t index) { return image.rgb.data() + 3 * index; }

std::size_t index_of(const EquirectImage& image, int i, int j) {
  return static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(i);
}

/// The median luminance by solid angle.
double median_luminance(const EquirectImage& image) {
  std::vector<std::pair<double, double>> patches;
  for (int j = 0; j < image.height; ++j) {
    const double omega = equirect_solid_angle(j, image.width, image.height);
    for (int i = 0; i < image.width; ++i) patches.emplace_back(luminance(pixel(image, index_of(image, i, j))), omega);
  }
  std::sort(patches.begin(), patches.end());
  double below = 0;
  for (const auto& [value, omega] : patches) {
    below += omega;
    if (below >= 2 * kPi) return value;
  }
  return patches.empty() ? 0 : patches.back().first;
}

/// The pixels of the bright region; empty for a black image.
std::vector<std::size_t> bright_pixels(const EquirectImage& image) {
  const int w = image.width, h = image.height;
  const std::size_t count = image.rgb.size() / 3;
  std::size_t peak = 0;
  for (std::size_t k = 1; k < count; ++k) {
    if (luminance(pixel(image, k)) > luminance(pixel(image, peak))) peak = k;
  }
  if (count == 0 || !(luminance(pixel(image, peak)) > 0)) return {};
  const double threshold = 0.5 * luminance(pixel(image, peak));
  std::vector<bool> seen(count);
  std::vector<std::size_t> open{peak}, found;
  seen[peak] = true;
  const auto visit = [&](int i, int j) {
    const std::size_t k = index_of(image, ((i % w) + w) % w, j);
    if (seen[k] || luminance(pixel(image, k)) < threshold) return;
    seen[k] = true;
    open.push_back(k);
  };
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    found.push_back(at);
    const int i = static_cast<int>(at % static_cast<std::size_t>(w)),
              j = static_cast<int>(at / static_cast<std::size_t>(w));
    for (int dj = -1; dj <= 1; ++dj) {
      const bool across = j + dj < 0 || j + dj >= h;  // beyond a pole is the same row, rotated by 180 degrees
      for (int di = -1; di <= 1; ++di) visit(i + di + (across ? w / 2 : 0), across ? j : j + dj);
    }
  }
  return found;
}

}  // namespace

NineCoefficients nine_coefficients(const EquirectImage& image) {
  NineCoefficients sum{};
  std::vector<double> sine, cosine;
  for (int i = 0; i < image.width; ++i) {
    const double phi = 2 * kPi * ((i + 0.5) / image.width - 0.5);
    sine.push_back(std::sin(phi));
    cosine.push_back(std::cos(phi));
  }
  for (int j = 0; j < image.height; ++j) {
    const double theta = kPi * (0.5 - (j + 0.5) / image.height);
    const double omega = equirect_solid_angle(j, image.width, image.height);
    NineCoefficients row{};
    for (int i = 0; i < image.width; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const auto y = basis({std::cos(theta) * sine[at], std::sin(theta), -std::cos(theta) * cosine[at]});
      const float* rgb = pixel(image, index_of(image, i, j));
      for (std::size_t k = 0; k < 9; ++k) {
        for (std::size_t c = 0; c < 3; ++c) row[k][c] += y[k] * rgb[c];
      }
    }
    for (std::size_t k = 0; k < 9; ++k) {
      for (std::size_t c = 0; c < 3; ++c) sum[k][c] += omega * row[k][c];
    }
  }
  return sum;
}

NineCoefficients to_condon_shortley(NineCoefficients coefficients) {
  for (const std::size_t odd : {1U, 3U, 5U, 7U}) {
    for (double& value : coefficients[odd]) value = -value;
  }
  return coefficients;
}

ArkitOutput arkit_output(const EquirectImage& image) { return {nine_coefficients(image)}; }

ArcoreOutput arcore_output(const EquirectImage& image) {
  ArcoreOutput out{};
  out.ambient = nine_coefficients(image);
  const double background = median_luminance(image);
  Triple centroid{};
  for (const std::size_t k : bright_pixels(image)) {
    const int i = static_cast<int>(k % static_cast<std::size_t>(image.width));
    const int j = static_cast<int>(k / static_cast<std::size_t>(image.width));
    const double omega = equirect_solid_angle(j, image.width, image.height);
    const Triple d = equirect_direction(i + 0.5, j + 0.5, image.width, image.height);
    const float* rgb = pixel(image, k);
    const double y = luminance(rgb);
    for (std::size_t c = 0; c < 3; ++c) centroid[c] += omega * y * d[c];
    const double share = y > background ? 1 - background / y : 0;
    const auto basis_here = basis(d);
    for (std::size_t c = 0; c < 3; ++c) {
      const double moved = omega * share * rgb[c];
      out.main_irradiance[c] += moved;
      for (std::size_t b = 0; b < 9; ++b) out.ambient[b][c] -= moved * basis_here[b];
    }
  }
  const double length = std::hypot(centroid[0], centroid[1], centroid[2]);
  if (length > 0) out.main_direction = {centroid[0] / length, centroid[1] / length, centroid[2] / length};
  return out;
}

Triple irradiance_of(const NineCoefficients& radiance, const Triple& normal) {
  constexpr std::array<double, 9> lobe{kPi,     2 * kPi / 3, 2 * kPi / 3, 2 * kPi / 3, kPi / 4,
                                       kPi / 4, kPi / 4,     kPi / 4,     kPi / 4};
  const auto y = basis(normal);
  Triple sum{};
  for (std::size_t k = 0; k < 9; ++k) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += lobe[k] * y[k] * radiance[k][c];
  }
  return sum;
}

Triple irradiance_of(const ArkitOutput& output, const Triple& normal) { return irradiance_of(output.total, normal); }

Triple irradiance_of(const ArcoreOutput& output, const Triple& normal) {
  Triple sum = irradiance_of(output.ambient, normal);
  const double cosine = std::max(0.0, normal[0] * output.main_direction[0] + normal[1] * output.main_direction[1] +
                                          normal[2] * output.main_direction[2]);
  for (std::size_t c = 0; c < 3; ++c) sum[c] += cosine * output.main_irradiance[c];
  return sum;
}

}  // namespace lightwell::bench
