// Single tags on a sphere around the probe, and the errors of detected corners.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "fixtures/board_pictures.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell::test {

inline constexpr double kDegree = std::numbers::pi / 180;

/// Unit vector at the angle `theta` from the probe's -Z (the lens axis), with azimuth `phi` from +X towards +Y.
inline Vec3d direction_at(double theta_deg, double phi_deg) {
  const double t = theta_deg * kDegree, p = phi_deg * kDegree;
  return {std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), -std::cos(t)};
}

inline TagBoard single_tag(int id, double size_m, TagFamily family = TagFamily::tag36h11) {
  TagBoard board;
  board.family = family;
  board.columns = board.rows = 1;
  board.tag_size_m = size_m;
  board.spacing = 1;
  board.first_id = id;
  return board;
}

/// Adds a ring of up to `max_count` tags, as many as fit beside each other, at 1 m, tilted by `tilt_deg` from facing
/// the probe, each with a different roll.
inline void add_ring(std::vector<PlacedBoard>& out, double theta_deg, int max_count, double size_m, double tilt_deg = 0,
                     TagFamily family = TagFamily::tag36h11) {
  const TagShape shape = shape_of(family);
  const double margin = (shape.cells - shape.edge_cells) / 2.0 / shape.edge_cells + 0.2;
  // Diagonal of the paper, because the roll is arbitrary.
  const double diagonal = size_m * (1 + 2 * margin) * std::numbers::sqrt2;
  const int count =
      std::min(max_count, static_cast<int>(2 * std::numbers::pi * std::sin(theta_deg * kDegree) / diagonal));
  for (int i = 0; i < count; ++i) {
    const Vec3d at = direction_at(theta_deg, 360.0 * i / count + 7);
    const Vec3d aside = tangent_basis(at)[static_cast<std::size_t>(i % 2)];
    const Vec3d towards = -at * std::cos(tilt_deg * kDegree) + aside * std::sin(tilt_deg * kDegree);
    out.push_back(board_facing(single_tag(static_cast<int>(out.size()), size_m, family), at, towards, 0.7 * i));
    out.back().margin = margin;
  }
}

struct CornerErrors {
  int corners = 0, refined = 0;
  double sum_x = 0, sum_y = 0, squares = 0, largest = 0;
  double normalized = 0;  ///< Sum of e' C^-1 e over refined corners.

  void add(const TagDetection& found, const TrueTag& truth) {
    for (std::size_t k = 0; k < 4; ++k) {
      const double x = found.corners[k].x - truth.corners[k].x, y = found.corners[k].y - truth.corners[k].y;
      ++corners;
      sum_x += x;
      sum_y += y;
      squares += x * x + y * y;
      largest = std::max(largest, std::hypot(x, y));
      const PixelCovariance c = found.covariance[k];
      if (!found.refined) continue;
      ++refined;
      normalized += (c.yy * x * x - 2 * c.xy * x * y + c.xx * y * y) / (c.xx * c.yy - c.xy * c.xy);
    }
  }
  /// RMS error of a coordinate, px.
  [[nodiscard]] double rms() const { return std::sqrt(squares / (2 * corners)); }
};

/// Corner errors of all detected tags. A detected tag that is not in the picture, or an error above 3 px, fails the
/// test.
inline CornerErrors errors_of(const std::vector<TagDetection>& found, const BoardPicture& picture) {
  CornerErrors errors;
  for (const TagDetection& tag : found) {
    const TrueTag* truth = picture.find(tag.family, tag.id);
    if (truth == nullptr) {
      ADD_FAILURE() << "tag " << tag.id << " is not in the picture";
      continue;
    }
    errors.add(tag, *truth);
  }
  if (errors.corners > 0) {
    EXPECT_LT(errors.largest, 3) << "no refined corner may belong to something else";
  }
  return errors;
}

}  // namespace lightwell::test
