#include "estimate/marker/tag_border.hpp"

#include <array>
#include <cmath>
#include <optional>

namespace lightwell::marker {
namespace {

/// Cells across a tag36h11, its black border included.
constexpr double kCells = 8;
/// Pairs of points along each side.
constexpr int kPairsPerSide = 6;
/// Smallest distance in the image between the middles of border and margin; below it, blur mixes them.
constexpr double kMinDistance_px = 3;
constexpr int kMinPairs = 8;
/// Largest ratio of a border pixel to the margin pixel beside it.
constexpr double kMaxInkRatio = 0.75;
/// Smallest share of pairs below that ratio in a border that is present.
constexpr double kMinInkFraction = 0.7;
/// Shifts of the border by the errors of folds and of the pose, in cells.
constexpr std::array<FacePoint, 5> kShifts = {{{0, 0}, {0.4, 0}, {-0.4, 0}, {0, 0.4}, {0, -0.4}}};
/// Smallest ratio of the margin's mean to its noise and bias near black.
constexpr double kMinSignalToNoise = 3;

}  // namespace

TagBorder detect_tag_border(estimate::RowReader& reader, estimate::LinearRow& row, int lens, int width, int height,
                            const MarkerBody& body, const MarkerFace& face, const PosedBody& posed_body) {
  if (body.tag_family != "tag36h11") return TagBorder::indeterminate;
  struct PixelSample {
    double light = 0, variance = 0, bias = 0;
    bool clipped = false;
  };
  estimate::ReadStatistics reading;
  const auto read_pixel = [&](const PixelPosition& p) -> std::optional<PixelSample> {
    if (!(p.x > -0.5 && p.y > -0.5 && p.x < width - 0.5 && p.y < height - 0.5)) return std::nullopt;
    const int x = static_cast<int>(std::lround(p.x)), y = static_cast<int>(std::lround(p.y));
    reader.read(lens, y, x, x + 1, estimate::RowReader::Reading::with_errors, row, reading);
    PixelSample out{(static_cast<double>(row.r[0]) + row.g[0] + row.b[0]) / 3};
    if (!row.certain) out.variance = row.variance[0], out.bias = row.bias[0], out.clipped = row.clipped[0] != 0;
    return out;
  };
  const double cell = body.tag_size_m / kCells, border = (kCells / 2 - 0.5) * cell, margin = (kCells / 2 + 0.5) * cell;
  const auto detect_at = [&](FacePoint shift) {
    int pairs = 0, ink = 0;
    double paper = 0, variance = 0, bias = 0;
    for (int side = 0; side < 4; ++side) {
      for (int k = 0; k < kPairsPerSide; ++k) {
        const double along = ((k + 0.5) / kPairsPerSide - 0.5) * 2 * border, sign = side < 2 ? 1 : -1;
        const auto at = [&](double out) {
          const FacePoint p = side % 2 == 0 ? FacePoint{sign * out, along} : FacePoint{along, sign * out};
          return posed_body.pixel_of(posed_body.point_of(face, {p.x + shift.x * cell, p.y + shift.y * cell}));
        };
        const std::optional<PixelPosition> inner = at(border), outer = at(margin);
        if (!inner || !outer || std::hypot(inner->x - outer->x, inner->y - outer->y) < kMinDistance_px) continue;
        const std::optional<PixelSample> black = read_pixel(*inner), white = read_pixel(*outer);
        if (!black || !white || black->clipped) continue;
        ++pairs;
        ink += black->light < kMaxInkRatio * white->light ? 1 : 0;
        paper += white->light, variance += white->variance, bias += white->bias;
      }
    }
    if (pairs < kMinPairs || !(paper > kMinSignalToNoise * (bias + std::sqrt(variance * pairs))))
      return TagBorder::indeterminate;
    return ink >= kMinInkFraction * pairs ? TagBorder::present : TagBorder::absent;
  };
  for (const FacePoint& shift : kShifts)
    if (const TagBorder found = detect_at(shift); found != TagBorder::absent) return found;
  return TagBorder::absent;
}

}  // namespace lightwell::marker
