// Irradiance and GGX-filtered radiance of a panorama at tens of thousands of directions in seconds: the sums
// of tests/reference, with pixels far from where the kernel changes taken together.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "reference/panorama.hpp"

namespace lightwell::measure {

class PanoramaSums {
 public:
  /// Of a cleaned panorama (reference::cleaned) of at least one pixel, which is copied.
  explicit PanoramaSums(const reference::Panorama& panorama);

  [[nodiscard]] const reference::Panorama& panorama() const { return panorama_; }

  /// reference::irradiance, to rounding: a block of pixels all above the horizon is one product of the normal
  /// and the block's vector sum, which is no approximation; the others are opened.
  [[nodiscard]] reference::Rgb irradiance(const reference::V3& unit_normal) const;

  /// reference::radiance_ggx with one sample a pixel, to about 0.2 %: a block that is small against the
  /// kernel's scale, sqrt(4 alpha^2 + theta^2), stands as one light at its centroid, channel by channel, with
  /// the kernel's second derivative times the block's spread. Roughness 0 is reference::sample, else 0.1..1.
  [[nodiscard]] reference::Rgb radiance(const reference::V3& unit_direction, double perceptual_roughness) const;

 private:
  /// What the search looks at. Its pixels are `pixels` from `first` on; its first part follows it.
  struct Block {
    reference::V3 centre{};  ///< Unit; every pixel's centre is within `radius` (a chord) of it.
    double radius = 0;
    std::int32_t second = -1;  ///< Index of the second part; -1 for a block without parts.
    std::int32_t first = 0, pixels = 0;
  };
  /// The integral over a block of one channel's radiance, or of 1, and of that times the direction.
  struct Moment {
    double sum = 0;
    reference::V3 vector{};
    reference::V3 centroid{};  ///< vector / sum; its length is below 1 by half the spread.
    double spread = 0;  ///< The variance of the direction in all of its plane, 1 - |centroid|^2, halved: per axis.
  };
  using Moments = std::array<Moment, 4>;  ///< r, g, b, and the solid angle.

  void build(int i0, int i1, int j0, int j1);
  /// Blocks and pixels that `axis` may see. `whole(block, moments, cosine of its centre)` takes a block as one, or
  /// returns false for it to be opened; `pixel(index, cosine, at least 0)` takes what is left.
  template <class Whole, class Pixel>
  void walk(const reference::V3& axis, const Whole& whole, const Pixel& pixel) const;

  reference::Panorama panorama_;
  std::vector<Block> blocks_;  ///< Depth first.
  std::vector<Moments> moments_;
  // Of the pixels, in the order of the blocks: direction, radiance times solid angle, solid angle.
  std::vector<double> x_, y_, z_;
  std::array<std::vector<double>, 4> weight_;
};

}  // namespace lightwell::measure
