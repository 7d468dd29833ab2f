// Outlines of shadows in pictures: contours with sub-pixel accuracy, and the distance between two of them.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace lightwell::measure {

/// One value of each pixel, rows from the top. NaN: a pixel that does not count.
struct GreyPicture {
  GreyPicture() = default;
  GreyPicture(int w, int h, double value = 0)
      : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value) {}

  int width = 0, height = 0;
  std::vector<double> values;

  [[nodiscard]] double& at(int x, int y) { return values[index(x, y)]; }
  [[nodiscard]] double at(int x, int y) const { return values[index(x, y)]; }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// The mean over (2 half + 1)² pixels, of those that count.
[[nodiscard]] GreyPicture box_means(const GreyPicture& picture, int half);

struct Point2 {
  double x = 0, y = 0;  ///< px; the centre of the top left pixel is (0, 0).
};
struct Segment {
  Point2 from, to;
};

/// The lines where the picture, bilinear between its pixels' centres, has the value `level` (marching squares: Lorensen
/// & Cline 1987 in two dimensions). Nothing beside pixels that do not count.
[[nodiscard]] std::vector<Segment> contour(const GreyPicture& picture, double level);

struct OutlineDistance {
  double median_px = std::numeric_limits<double>::quiet_NaN();
  double percentile_95_px = std::numeric_limits<double>::quiet_NaN();
};

/// Distances from the middle of each segment of one outline to the nearest place of the other one, both ways together.
/// NaN if one of them is empty.
[[nodiscard]] OutlineDistance outline_distance(std::span<const Segment> a, std::span<const Segment> b);

}  // namespace lightwell::measure
