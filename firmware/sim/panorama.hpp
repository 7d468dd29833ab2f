// A panorama: distant radiance over all directions, the environment of the simulated camera.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell::sim {

/// Numbers of values that were not valid radiance and have been replaced.
struct SanitizeCounts {
  std::size_t nan = 0;       ///< Became 0.
  std::size_t infinite = 0;  ///< +Inf; became the file's largest finite number.
  std::size_t negative = 0;  ///< Became 0. Resampled panoramas ring next to the sun.

  [[nodiscard]] bool any() const { return nan + infinite + negative > 0; }
};

/// A direction as fractions, in units of 2^-32, of the equirectangular picture's width and height: u wraps by integer
/// overflow, and a rotation about +Y is one addition. Resolution 1.5e-9 rad.
struct SpherePoint {
  std::uint32_t u = 0, v = 0;
};

/// The nearest point, by the equirectangular mapping of proto/README.md. The direction need not be normalised.
[[nodiscard]] SpherePoint sphere_point(Vec3d direction);

/// Equirectangular radiance, rows from the top, r, g, b per pixel; world frame.
struct Panorama {
  int width = 0, height = 0;  ///< width = 2 height.
  std::vector<float> rgb;
  SanitizeCounts sanitize_counts;

  /// Bilinear interpolation between pixel centres, also across the seam, and across a pole to the opposite meridian.
  [[nodiscard]] Radiance radiance(SpherePoint point) const;
  [[nodiscard]] Radiance radiance(Vec3d direction) const { return radiance(sphere_point(direction)); }
  /// Radiance of the pixel in column i, row j; columns wrap around.
  [[nodiscard]] Radiance pixel(int i, int j) const;
};

/// Replaces invalid values and counts them. invalid_argument, with the remedy, if width is not 2 height.
[[nodiscard]] Result<Panorama> make_panorama(int width, int height, std::vector<float> rgb);

/// Reads an OpenEXR or Radiance picture. Errors of read_image() and make_panorama(), with the path.
[[nodiscard]] Result<Panorama> load_panorama(const std::string& path);

/// Samples f at the pixel centres. The height is half the width.
[[nodiscard]] Panorama from_function(int width, const std::function<Radiance(Vec3d)>& f);

/// The file of a named scene (city, courtyard, forest, interior, night, studio, sunrise, sunset) in the folder
/// $LIGHTWELL_PANORAMA_DIR or else the cache of cmake/fetch_panoramas. A name that ends in .exr or .hdr is returned as
/// the path. not_found if the file has not been fetched, invalid_argument for an unknown name, both with the remedy.
[[nodiscard]] Result<std::string> scene_path(std::string_view name_or_path);

/// Mean luminance over the sphere, weighted by solid angle.
[[nodiscard]] double mean_luminance(const Panorama& panorama);

/// Percentile of luminance over the sphere: the luminance that the fraction `share` of the sphere does not exceed.
[[nodiscard]] double luminance_percentile(const Panorama& panorama, double share);

/// The pixels of a panorama above 50 times its mean luminance, which the renderer must supersample, and their eight
/// neighbours, because bilinear interpolation spreads them that far.
class HighlightMask {
 public:
  HighlightMask() = default;
  explicit HighlightMask(const Panorama& panorama);

  [[nodiscard]] bool at(SpherePoint point) const {
    const auto column = static_cast<std::size_t>(point.u * width_ >> 32);
    const auto row = static_cast<std::size_t>(point.v * height_ >> 32);
    return mask_[row * width_ + column] != 0;
  }

 private:
  std::uint64_t width_ = 0, height_ = 0;
  std::vector<std::uint8_t> mask_;
};

}  // namespace lightwell::sim
