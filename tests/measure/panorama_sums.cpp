#include "measure/panorama_sums.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lightwell::measure {

namespace ref = reference;

namespace {

constexpr int kLeafPixels = 16;

/// Opening criterion: a block is treated as one light if its radius is below this fraction of the kernel's scale at its
/// distance. The error falls at least with its square.
constexpr double kOpening = 0.12;

/// A larger block is opened if it crosses the horizon, where the kernel has a kink.
constexpr double kHorizon = 0.1;

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

}  // namespace

PanoramaSums::PanoramaSums(const ref::Panorama& panorama) : panorama_(panorama) {
  build(0, panorama_.width, 0, panorama_.height);
}

void PanoramaSums::build(int i0, int i1, int j0, int j1) {
  const std::size_t at = blocks_.size();
  blocks_.emplace_back();
  moments_.emplace_back();
  Block block;
  block.first = static_cast<std::int32_t>(x_.size());
  block.pixels = (i1 - i0) * (j1 - j0);

  const int columns = i1 - i0, rows = j1 - j0;
  if (block.pixels > kLeafPixels) {
    // Splits the side that is longer on the sphere, measured at the block's widest row.
    const double widest_row =
        std::clamp(0.5 * (panorama_.height - 1), static_cast<double>(j0), static_cast<double>(j1 - 1));
    const double width = 2.0 * columns / panorama_.width * std::sin(ref::pi * (widest_row + 0.5) / panorama_.height);
    if (rows == 1 || (columns > 1 && width > static_cast<double>(rows) / panorama_.height)) {
      build(i0, i0 + columns / 2, j0, j1);
      block.second = static_cast<std::int32_t>(blocks_.size());
      build(i0 + columns / 2, i1, j0, j1);
    } else {
      build(i0, i1, j0, j0 + rows / 2);
      block.second = static_cast<std::int32_t>(blocks_.size());
      build(i0, i1, j0 + rows / 2, j1);
    }
  } else {
    for (int j = j0; j < j1; ++j) {
      const double omega = ref::pixel_solid_angle(j, panorama_.width, panorama_.height);
      for (int i = i0; i < i1; ++i) {
        const ref::V3 d = ref::pixel_direction(i, j, panorama_.width, panorama_.height);
        const ref::Rgb radiance = ref::pixel(panorama_, i, j);
        x_.push_back(d.x);
        y_.push_back(d.y);
        z_.push_back(d.z);
        for (std::size_t c = 0; c < 3; ++c) weight_[c].push_back(omega * radiance[c]);
        weight_[3].push_back(omega);
      }
    }
  }

  Moments moments;
  const std::size_t first = index(block.first), end = x_.size();
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t k = first; k < end; ++k) {
      moments[c].sum += weight_[c][k];
      moments[c].vector = moments[c].vector + weight_[c][k] * ref::V3{x_[k], y_[k], z_[k]};
    }
  }
  // The vector sum of a whole sphere or belt is about zero; any centre is valid for such a block.
  block.centre = ref::normalised(moments[3].vector);
  if (!(ref::length(block.centre) > 0.5)) block.centre = {0, 1, 0};
  for (std::size_t k = first; k < end; ++k)
    block.radius = std::max(block.radius, ref::length(ref::V3{x_[k], y_[k], z_[k]} - block.centre));
  for (Moment& m : moments) {
    m.centroid = m.sum > 0 ? (1 / m.sum) * m.vector : block.centre;
    m.spread = 0.5 * std::max(0.0, 1 - ref::dot(m.centroid, m.centroid));
  }
  blocks_[at] = block;
  moments_[at] = moments;
}

template <class Whole, class Pixel>
void PanoramaSums::walk(const ref::V3& axis, const Whole& whole, const Pixel& pixel) const {
  std::vector<std::int32_t> open{0};
  while (!open.empty()) {
    const std::int32_t at = open.back();
    open.pop_back();
    const Block& block = blocks_[index(at)];
    const double cosine = ref::dot(axis, block.centre);
    if (cosine <= -block.radius || whole(block, moments_[index(at)], cosine)) continue;
    if (block.second >= 0) {
      open.push_back(at + 1);
      open.push_back(block.second);
      continue;
    }
    const std::size_t end = index(block.first + block.pixels);
    for (std::size_t k = index(block.first); k < end; ++k) {
      const double product = axis.x * x_[k] + axis.y * y_[k] + axis.z * z_[k];
      pixel(k, product > 0 ? product : 0);
    }
  }
}

ref::Rgb PanoramaSums::irradiance(const ref::V3& n) const {
  ref::Rgb sum{};
  const auto whole = [&](const Block& block, const Moments& moments, double cosine) {
    if (cosine < block.radius) return false;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += ref::dot(n, moments[c].vector);
    return true;
  };
  walk(n, whole, [&](std::size_t k, double cosine) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += cosine * weight_[c][k];
  });
  return sum;
}

ref::Rgb PanoramaSums::radiance(const ref::V3& d, double perceptual_roughness) const {
  if (perceptual_roughness == 0) return ref::sample(panorama_, d);
  // reference::GgxKernel::weight up to a constant factor, which the final division cancels: t / D^2 with
  // D = a2 + slope (1 - t).
  const double a2 = std::pow(perceptual_roughness, 4), slope = 0.5 * (1 - a2);
  std::array<double, 4> sum{};
  const auto whole = [&](const Block& block, const Moments& moments, double cosine) {
    // |l - d|^2 = 2 (1 - cosine) is about theta^2.
    const bool small = block.radius * block.radius <= kOpening * kOpening * (4 * a2 + 2 * (1 - cosine));
    if (!small || (cosine < block.radius && block.radius > kHorizon)) return false;
    for (std::size_t c = 0; c < 4; ++c) {
      const Moment& m = moments[c];
      const double t = ref::dot(d, m.centroid);
      if (t <= 0) continue;
      const double inverse = 1 / (a2 + slope * (1 - t)), inverse2 = inverse * inverse;
      const double curvature = (4 * slope + 6 * slope * slope * t * inverse) * inverse2 * inverse;  // d2k / dt2
      // The variance of t = d . l, the block spread evenly in its plane: per axis, times sin^2.
      const double variance = m.spread * std::max(0.0, 1 - t * t);
      sum[c] += m.sum * (t * inverse2 + 0.5 * curvature * variance);
    }
    return true;
  };
  walk(d, whole, [&](std::size_t k, double t) {
    const double inverse = 1 / (a2 + slope * (1 - t));
    const double weight = t * inverse * inverse;
    for (std::size_t c = 0; c < 4; ++c) sum[c] += weight * weight_[c][k];
  });
  return {sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]};
}

}  // namespace lightwell::measure
