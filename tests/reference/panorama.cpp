#include "reference/panorama.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lightwell::reference {

namespace {

std::size_t offset(const Panorama& p, int i, int j) {
  return 3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(i));
}

Panorama black(int width, int height) {
  return {width, height, std::vector<double>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
}

/// The mean of f over one pixel, see from_function.
Rgb pixel_mean(int i, int j, int width, int height, const RadianceFunction& f, int samples) {
  Rgb mean{};
  double weights = 0;
  for (int b = 0; b < samples; ++b) {
    const double y = j - 0.5 + (b + 0.5) / samples;
    const double weight = pixel_solid_angle(j * samples + b, width, height * samples);
    for (int a = 0; a < samples; ++a) {
      const double x = i - 0.5 + (a + 0.5) / samples;
      const Rgb value = f(pixel_direction(x, y, width, height));
      for (std::size_t c = 0; c < 3; ++c) mean[c] += weight * value[c];
      weights += weight;
    }
  }
  for (double& value : mean) value /= weights;
  return mean;
}

int wrapped(int i, int width) { return ((i % width) + width) % width; }

/// Row j at the fractional column x, linear between centres, with wrap-around at the seam.
Rgb row_at(const Panorama& p, double x, int j) {
  const double floor_x = std::floor(x);
  const double t = x - floor_x;
  const int i = static_cast<int>(floor_x);
  const Rgb left = pixel(p, wrapped(i, p.width), j);
  const Rgb right = pixel(p, wrapped(i + 1, p.width), j);
  Rgb value{};
  for (std::size_t c = 0; c < 3; ++c) value[c] = (1 - t) * left[c] + t * right[c];
  return value;
}

}  // namespace

Rgb pixel(const Panorama& p, int i, int j) {
  const std::size_t at = offset(p, i, j);
  return {p.rgb[at], p.rgb[at + 1], p.rgb[at + 2]};
}

void set_pixel(Panorama& p, int i, int j, const Rgb& radiance) {
  std::copy(radiance.begin(), radiance.end(), p.rgb.begin() + static_cast<std::ptrdiff_t>(offset(p, i, j)));
}

V3 pixel_direction(double i, double j, int width, int height) {
  const double phi = 2 * pi * ((i + 0.5) / width - 0.5);
  const double theta = pi * (0.5 - (j + 0.5) / height);
  return {std::cos(theta) * std::sin(phi), std::sin(theta), -std::cos(theta) * std::cos(phi)};
}

V2 direction_to_pixel(const V3& direction, int width, int height) {
  const double phi = std::atan2(direction.x, -direction.z);
  const double theta = std::atan2(direction.y, std::hypot(direction.x, direction.z));
  return {width * (phi / (2 * pi) + 0.5) - 0.5, height * (0.5 - theta / pi) - 0.5};
}

double pixel_solid_angle(int j, int width, int height) {
  const double centre_from_pole = pi * (j + 0.5) / height;
  return (2 * pi / width) * 2 * std::sin(centre_from_pole) * std::sin(0.5 * pi / height);
}

Panorama cleaned(const Panorama& p) {
  double largest = 0;
  for (const double value : p.rgb) {
    if (std::isfinite(value)) largest = std::max(largest, value);
  }
  Panorama result = p;
  for (double& value : result.rgb) {
    if (std::isnan(value) || value < 0) {
      value = 0;
    } else if (std::isinf(value)) {
      value = largest;
    }
  }
  return result;
}

Rgb mean_radiance(const Panorama& p) {
  Rgb mean{};
  for (int j = 0; j < p.height; ++j) {
    const double share = pixel_solid_angle(j, p.width, p.height) / (4 * pi);
    for (int i = 0; i < p.width; ++i) {
      const Rgb value = pixel(p, i, j);
      for (std::size_t c = 0; c < 3; ++c) mean[c] += share * value[c];
    }
  }
  return mean;
}

Rgb sample(const Panorama& p, const V3& direction) {
  const V2 at = direction_to_pixel(direction, p.width, p.height);
  const int upper = static_cast<int>(std::floor(at.y));
  const double t = at.y - upper;
  const auto row = [&](int j) {
    if (j < 0) return row_at(p, at.x + 0.5 * p.width, 0);
    if (j >= p.height) return row_at(p, at.x + 0.5 * p.width, p.height - 1);
    return row_at(p, at.x, j);
  };
  const Rgb above = row(upper);
  const Rgb below = row(upper + 1);
  Rgb value{};
  for (std::size_t c = 0; c < 3; ++c) value[c] = (1 - t) * above[c] + t * below[c];
  return value;
}

Panorama constant(int width, int height, const Rgb& radiance) {
  return from_function(
      width, height, [&](const V3&) { return radiance; }, 1);
}

Panorama from_function(int width, int height, const RadianceFunction& f, int samples_per_axis) {
  Panorama p = black(width, height);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      set_pixel(p, i, j, pixel_mean(i, j, width, height, f, samples_per_axis));
    }
  }
  return p;
}

Panorama disc_lamp(int width, int height, const V3& direction, double angular_radius_rad, const Rgb& radiance,
                   int rim_samples) {
  const double ramp = pi / height / rim_samples;
  // Every point of a pixel is within half a step along the parallel plus half a step along the
  // meridian of its centre.
  const double reach = pi / width + 0.5 * pi / height + 0.5 * ramp;
  const auto distance = [&](const V3& d) { return angle_deg(direction, d) * pi / 180.0; };
  const RadianceFunction scene = [&](const V3& d) {
    const double cover = std::clamp(0.5 + (angular_radius_rad - distance(d)) / ramp, 0.0, 1.0);
    return Rgb{cover * radiance[0], cover * radiance[1], cover * radiance[2]};
  };
  Panorama p = black(width, height);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const V3 centre = pixel_direction(i, j, width, height);
      const bool rim = std::abs(distance(centre) - angular_radius_rad) <= reach;
      set_pixel(p, i, j, rim ? pixel_mean(i, j, width, height, scene, rim_samples) : scene(centre));
    }
  }
  return p;
}

Panorama sum(const Panorama& a, const Panorama& b) {
  Panorama result = a;
  for (std::size_t k = 0; k < result.rgb.size(); ++k) result.rgb[k] += b.rgb.at(k);
  return result;
}

Panorama turned(const Panorama& p, const M3& rotation, int width, int height, int samples_per_axis) {
  const M3 back = transposed(rotation);
  return from_function(
      width, height, [&](const V3& d) { return sample(p, rotated(back, d)); }, samples_per_axis);
}

}  // namespace lightwell::reference
