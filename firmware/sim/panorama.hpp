// A panorama: radiance over all directions from a picture file, the world that the simulated camera
// stands in.
//   scene_path      "city" -> a file        load_panorama   a file -> radiance, cleaned
//   from_function   radiance written as a formula
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

/// How many numbers of a file were no radiance, and have been replaced.
struct SanitizeCounts {
  std::size_t nan = 0;       ///< Became 0.
  std::size_t infinite = 0;  ///< +Inf; became the file's largest finite number.
  std::size_t negative = 0;  ///< Became 0. Real panoramas ring beside a sun.

  [[nodiscard]] bool any() const { return nan + infinite + negative > 0; }
};

/// A direction as fractions of 2^32 of the equirectangular picture's width and height: u wraps by
/// itself, and a turn about +Y is one addition. Resolution 1.5e-9 rad.
struct SpherePoint {
  std::uint32_t u = 0, v = 0;
};

/// The nearest point, in the house's equirectangular mapping. The direction need not be normalised.
[[nodiscard]] SpherePoint sphere_point(Vec3d direction);

/// Equirectangular radiance, rows from the top, r g b a pixel. Its axes are the world's.
struct Panorama {
  int width = 0, height = 0;  ///< width = 2 height.
  std::vector<float> rgb;
  SanitizeCounts sanitize_counts;

  /// Bilinear between pixel centres; over the seam, and over a pole to the opposite meridian.
  [[nodiscard]] Radiance radiance(SpherePoint point) const;
  [[nodiscard]] Radiance radiance(Vec3d direction) const { return radiance(sphere_point(direction)); }
  /// Of the pixel in column i, row j; columns wrap.
  [[nodiscard]] Radiance pixel(int i, int j) const;
};

/// Replaces what is no radiance and counts it. invalid_argument, with the remedy, where width is
/// not 2 height.
[[nodiscard]] Result<Panorama> make_panorama(int width, int height, std::vector<float> rgb);

/// Reads an OpenEXR or Radiance picture. Errors of read_image() and make_panorama(), with the path.
[[nodiscard]] Result<Panorama> load_panorama(const std::string& path);

/// f at the pixel centres. A height of half the width.
[[nodiscard]] Panorama from_function(int width, const std::function<Radiance(Vec3d)>& f);

/// The file of a named scene: city, courtyard, forest, interior, night, studio, sunrise, sunset, in
/// the folder $LIGHTWELL_PANORAMA_DIR or else the cache of cmake/fetch_panoramas. A name that ends in
/// .exr or .hdr is a path already. not_found where the file has not been fetched, invalid_argument
/// for an unknown name; both say what to do.
[[nodiscard]] Result<std::string> scene_path(std::string_view name_or_path);

/// Mean over the sphere, by solid angle.
[[nodiscard]] double mean_luminance(const Panorama& panorama);

/// The radiance whose luminance a share of the sphere stays below, by solid angle: 0.99 leaves the
/// brightest hundredth.
[[nodiscard]] double luminance_percentile(const Panorama& panorama, double share);

}  // namespace lightwell::sim
