// Irradiance and GGX-filtered radiance of a panorama at tens of thousands of directions in seconds: the sums of
// tests/reference, accelerated by a hierarchy of pixel blocks (as Barnes and Hut 1986).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "reference/panorama.hpp"

namespace lightwell::measure {

class PanoramaSums {
 public:
  /// `panorama` must be cleaned (reference::cleaned) and have at least one pixel; it is copied.
  explicit PanoramaSums(const reference::Panorama& panorama);

  [[nodiscard]] const reference::Panorama& panorama() const { return panorama_; }

  /// reference::irradiance up to rounding. A block entirely above the horizon contributes the dot product of the normal
  /// and the block's vector sum, which is exact; blocks across the horizon are opened.
  [[nodiscard]] reference::Rgb irradiance(const reference::V3& unit_normal) const;

  /// reference::radiance_ggx with one sample per pixel, to about 0.2 %. A block that is small compared with the
  /// kernel's scale, sqrt(4 alpha^2 + theta^2), is treated per channel as one light at its centroid, corrected by the
  /// kernel's second derivative times the block's spread. Roughness 0 uses reference::sample; otherwise 0.1 to 1.
  [[nodiscard]] reference::Rgb radiance(const reference::V3& unit_direction, double perceptual_roughness) const;

 private:
  /// A node of the hierarchy. It has `pixels` pixels from index `first` on; its first child follows it in the list.
  struct Block {
    reference::V3 centre{};  ///< Unit; every pixel's centre is within `radius` (a chord) of it.
    double radius = 0;
    std::int32_t second = -1;  ///< Index of the second child; -1 for a leaf.
    std::int32_t first = 0, pixels = 0;
  };
  /// Integral over a block of one channel's radiance (or of 1), and of the same times the direction.
  struct Moment {
    double sum = 0;
    reference::V3 vector{};
    reference::V3 centroid{};  ///< vector / sum; its length is below 1 by half the spread.
    double spread = 0;         ///< Variance of the direction per axis: (1 - |centroid|^2) / 2.
  };
  using Moments = std::array<Moment, 4>;  ///< r, g, b, and the solid angle.

  void build(int i0, int i1, int j0, int j1);
  /// Visits blocks and pixels in the hemisphere of `axis`. `whole(block, moments, cosine of its centre)` handles a
  /// block as a whole, or returns false to open it; `pixel(index, cosine >= 0)` handles single pixels.
  template <class Whole, class Pixel>
  void walk(const reference::V3& axis, const Whole& whole, const Pixel& pixel) const;

  reference::Panorama panorama_;
  std::vector<Block> blocks_;  ///< In depth-first order.
  std::vector<Moments> moments_;
  // For each pixel, in the order of the blocks: direction, radiance times solid angle, solid angle.
  std::vector<double> x_, y_, z_;
  std::array<std::vector<double>, 4> weight_;
};

}  // namespace lightwell::measure
