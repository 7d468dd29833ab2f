#include "reference/block_light.hpp"

#include <algorithm>
#include <cmath>

#include "reference/harmonics.hpp"

namespace lightwell::reference {
namespace {

double curve(const Sensor& sensor, double value) {
  switch (sensor.curve) {
    case Sensor::Curve::linear:
      return value;
    case Sensor::Curve::srgb:
      // IEC 61966-2-1.
      return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    case Sensor::Curve::gamma:
      return std::pow(value, sensor.gamma);
    case Sensor::Curve::table: {
      const double at = value * static_cast<double>(sensor.table.size() - 1);
      const double below = std::min(std::floor(at), static_cast<double>(sensor.table.size() - 2));
      const auto i = static_cast<std::size_t>(below);
      return sensor.table[i] + (at - below) * (sensor.table[i + 1] - sensor.table[i]);
    }
  }
  return value;
}

/// Radiance of a pixel from one image of the bracket.
struct Reading {
  Rgb x{};
  double variance = 0;
  bool saturated = false;
};

/// Linear values of all codes.
std::vector<double> linear_values(const Sensor& sensor, unsigned levels) {
  std::vector<double> linear;
  for (unsigned code = 0; code < levels; ++code)
    linear.push_back(linear_value(sensor, static_cast<double>(code) / (levels - 1)));
  return linear;
}

Reading read(const Sensor& sensor, const CodePicture& picture, const std::vector<double>& linear, std::size_t pixel,
             bool alone) {
  const Codes& c = picture.codes[pixel];
  Reading out;
  out.x = {linear[c.red], 0.5 * (linear[c.green1] + linear[c.green2]), linear[c.blue]};
  const unsigned brightest = std::max({c.red, c.green1, c.green2, c.blue});
  const unsigned upper = std::max(brightest, 1U);
  const double step = linear[upper] - linear[upper - 1];
  const double light = alone ? out.x[1] : std::max({out.x[0], out.x[1], out.x[2]});
  out.variance = sensor.read_noise * sensor.read_noise + sensor.shot_noise * std::max(light, 0.0) + step * step / 12;
  out.saturated = (alone ? brightest : std::max(brightest, c.beside)) >= sensor.saturation * (picture.levels - 1);
  return out;
}

}  // namespace

double linear_value(const Sensor& sensor, double value) {
  return (curve(sensor, value) - sensor.black) / (1 - sensor.black);
}

std::vector<PixelLight> light_of(const LensPixels& lens, const Sensor& sensor, std::span<const CodePicture> bracket) {
  std::vector<std::vector<double>> linear;
  for (const CodePicture& picture : bracket) linear.push_back(linear_values(sensor, picture.levels));
  std::vector<PixelLight> out(lens.solid_angle.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!(lens.solid_angle[i] > 0)) continue;
    PixelLight& light = out[i];
    Rgb bound{}, sum{};
    double weights = 0;
    for (std::size_t e = 0; e < bracket.size(); ++e) {
      const Reading r = read(sensor, bracket[e], linear[e], i, bracket.size() == 1);
      const double unit = 1 / bracket[e].exposure;
      // Avoids an infinite weight for a camera without noise and rounding.
      const double w = 1 / ((r.variance + 1e-12) * unit * unit);
      for (std::size_t c = 0; c < 3; ++c) bound[c] = std::max(bound[c], r.x[c] * unit);
      if (r.saturated && bracket.size() > 1) continue;
      weights += w;
      for (std::size_t c = 0; c < 3; ++c) sum[c] += w * r.x[c] * unit;
      if (bracket.size() == 1) {
        light.clipped = r.saturated;
        light.variance = r.variance * unit * unit;
      }
    }
    if (bracket.size() > 1) {
      light.clipped = weights == 0;
      light.variance = light.clipped ? 0 : 1 / weights;
    }
    const double bright = lens.inverse_vignetting[i];
    light.variance *= bright * bright;
    for (std::size_t c = 0; c < 3; ++c)
      light.radiance[c] = (weights > 0 ? sum[c] / weights : bound[c]) * sensor.white[c] * bright;
  }
  return out;
}

LensLight block_light(const LensPixels& lens, std::span<const PixelLight> pixels, int edge) {
  LensLight out;
  for (int top = 0; top < lens.height; top += edge) {
    for (int left = 0; left < lens.width; left += edge) {
      BlockLight block;
      V2 light_at, middle;
      for (int y = top; y < std::min(top + edge, lens.height); ++y) {
        for (int x = left; x < std::min(left + edge, lens.width); ++x) {
          const auto i =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x);
          const double sr = lens.solid_angle[i];
          if (!(sr > 0)) continue;
          const PixelLight& p = pixels[i];
          const double l = luminance(p.radiance);
          for (std::size_t c = 0; c < 3; ++c) block.sum[c] += sr * p.radiance[c];
          block.peak = std::max(block.peak, l);
          block.luminance += sr * l;
          block.solid_angle += sr;
          light_at = {light_at.x + sr * l * (x - left), light_at.y + sr * l * (y - top)};
          middle = {middle.x + sr * (x - left), middle.y + sr * (y - top)};
          out.noise += sr * sr * p.variance;
          if (p.clipped) out.clipped_sr += sr;
        }
      }
      if (block.luminance > 0)
        block.offset = {light_at.x / block.luminance - middle.x / block.solid_angle,
                        light_at.y / block.luminance - middle.y / block.solid_angle};
      out.blocks.push_back(block);
    }
  }
  return out;
}

std::vector<double> block_harmonics(const LensPixels& lens, int edge, int band) {
  const auto count = static_cast<std::size_t>((band + 1) * (band + 1));
  const auto columns = static_cast<std::size_t>((lens.width + edge - 1) / edge);
  const auto rows = static_cast<std::size_t>((lens.height + edge - 1) / edge);
  std::vector<double> means(columns * rows * count), total(columns * rows);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x);
      const double sr = lens.solid_angle[i];
      if (!(sr > 0)) continue;
      const std::size_t block = static_cast<std::size_t>(y / edge) * columns + static_cast<std::size_t>(x / edge);
      // Directions are floats; the harmonics need a unit vector.
      const std::vector<double> at = harmonics(normalised(lens.direction[i]), band);
      total[block] += sr;
      for (std::size_t k = 0; k < count; ++k) means[block * count + k] += sr * at[k];
    }
  }
  for (std::size_t block = 0; block < total.size(); ++block)
    for (std::size_t k = 0; k < count && total[block] > 0; ++k) means[block * count + k] /= total[block];
  return means;
}

std::vector<Rgb> cell_coefficients(std::span<const double> means, int band, std::span<const double> solid_angle,
                                   std::span<const Rgb> sums, int fitted_band) {
  const auto count = static_cast<std::size_t>((band + 1) * (band + 1));
  std::vector<Rgb> out(count);
  for (std::size_t cell = 0; cell < sums.size(); ++cell)
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t c = 0; c < 3; ++c) out[k][c] += sums[cell][c] * means[cell * count + k];
  if (fitted_band < 0) return out;
  const auto n = static_cast<std::size_t>((fitted_band + 1) * (fitted_band + 1));
  // Normal equations, then their lower Cholesky factor in place.
  std::vector<double> a(n * n);
  for (std::size_t cell = 0; cell < sums.size(); ++cell) {
    const double* y = means.data() + cell * count;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j <= i; ++j) a[i * n + j] += solid_angle[cell] * y[i] * y[j];
  }
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = j; i < n; ++i) {
      for (std::size_t k = 0; k < j; ++k) a[i * n + j] -= a[i * n + k] * a[j * n + k];
      a[i * n + j] = i == j ? std::sqrt(a[i * n + j]) : a[i * n + j] / a[j * n + j];
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < i; ++k) out[i][c] -= a[i * n + k] * out[k][c];
      out[i][c] /= a[i * n + i];
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = i + 1; k < n; ++k) out[i][c] -= a[k * n + i] * out[k][c];
      out[i][c] /= a[i * n + i];
    }
  }
  return out;
}

}  // namespace lightwell::reference
