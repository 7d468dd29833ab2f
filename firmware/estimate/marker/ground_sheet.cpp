#include "estimate/marker/ground_sheet.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

/// Samples on both sides of the edge, between which a mixed one was left out, are at most this many steps apart.
constexpr double kMaxPairSteps = 2.3;
constexpr std::size_t kMinPairs = 6;
/// The colours of lamps from 2,700 to 6,500 K lie on a line in (ln r/g, ln b/g); this is its slope with opposite sign,
/// for sRGB's primaries.
constexpr double kInvariantSlope = 1.85;
/// Standard deviation of the invariant for independent relative errors of 1 in r, g and b.
constexpr double kInvariantNoise = 3.5;
/// Largest difference of the invariant from the surface's median: cameras' primaries, windows, light from other
/// objects.
constexpr double kMaxInvariantDifference = 0.2;
/// The same in standard deviations of the noise, in addition.
constexpr double kMaxInvariantDeviation = 4;
/// Channels below this share of the colour count as it: their ratios are noise.
constexpr double kMinChannelShare = 1e-3;
/// Width of the margin around a tag of which the samples are left out, relative to the tag: one cell.
constexpr double kTagMargin = 0.125;

/// Even-odd rule.
bool inside(const FaceOutline& outline, FacePoint p) {
  bool in = false;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const FacePoint &a = outline[i], &b = outline[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x) in = !in;
  }
  return in;
}

}  // namespace

GroundCover ground_cover(const MarkerBody& body, const PosedBody& posed_body, Vec3d position, double half_step) {
  if (!body.ball || body.faces.empty() || body.faces[0].outline.empty()) return GroundCover::table;
  const MarkerFace& sheet = body.faces[0];
  const Vec3d origin = posed_body.point_of(sheet, {0, 0});
  const Vec3d x = posed_body.point_of(sheet, {1, 0}) - origin, y = posed_body.point_of(sheet, {0, 1}) - origin;
  const FacePoint middle{dot(position - origin, x), dot(position - origin, y)};
  // The circle around the square, whatever the angle between the sheet's axes and the plane's.
  const double reach = half_step * std::sqrt(2.0), tag = body.tag_size_m * (0.5 + kTagMargin) + reach;
  if (std::abs(middle.x) < tag && std::abs(middle.y) < tag) return GroundCover::mixed;
  int covered = 0;
  for (int k = 0; k < 8; ++k) {
    const double a = k * std::numbers::pi / 4;
    covered += inside(sheet.outline, {middle.x + reach * std::cos(a), middle.y + reach * std::sin(a)}) ? 1 : 0;
  }
  return covered == 8 ? GroundCover::sheet : covered == 0 ? GroundCover::table : GroundCover::mixed;
}

void remove_clutter(GroundPlane& ground, std::vector<GroundCover>& covers) {
  std::vector<double> invariants(covers.size()), of_cover;
  for (std::size_t i = 0; i < covers.size(); ++i) {
    const Rgb& c = ground.samples[i].color;
    const double dark = kMinChannelShare * (c[0] + c[1] + c[2]) + 1e-300;
    const double r = std::max(c[0], dark), g = std::max(c[1], dark), b = std::max(c[2], dark);
    invariants[i] = kInvariantSlope * std::log(r / g) + std::log(b / g);
  }
  std::vector<bool> clutter(covers.size());
  for (const GroundCover cover : {GroundCover::table, GroundCover::sheet}) {
    of_cover.clear();
    for (std::size_t i = 0; i < covers.size(); ++i)
      if (covers[i] == cover) of_cover.push_back(invariants[i]);
    if (of_cover.empty()) continue;
    const double middle = order_statistic(of_cover, of_cover.size() / 2);
    for (std::size_t i = 0; i < covers.size(); ++i) {
      const GroundSample& sample = ground.samples[i];
      const double sigma = kInvariantNoise * sample.sigma / std::max(sample.radiance, 1e-300);
      if (covers[i] == cover)
        clutter[i] = std::abs(invariants[i] - middle) > kMaxInvariantDifference + kMaxInvariantDeviation * sigma;
    }
  }
  std::size_t at = 0;
  std::erase_if(ground.samples, [&](const GroundSample&) { return clutter[at++]; });
  at = 0;
  std::erase_if(covers, [&](GroundCover) { return clutter[at++]; });
}

void equalize_sheet(GroundPlane& ground, std::span<const GroundCover> covers) {
  const auto count = static_cast<std::size_t>(std::ranges::count(covers, GroundCover::sheet));
  if (count == 0 || count == covers.size()) return;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < covers.size(); ++i) {
    if (covers[i] != GroundCover::sheet) continue;
    const GroundSample& on = ground.samples[i];
    for (std::size_t j = 0; j < covers.size(); ++j) {
      const GroundSample& off = ground.samples[j];
      if (covers[j] == GroundCover::table && on.radiance > 0 &&
          length(on.position - off.position) <= kMaxPairSteps * ground.step_m)
        ratios.push_back(off.radiance / on.radiance);
    }
  }
  if (ratios.size() < kMinPairs) {
    const GroundCover kept = 2 * count >= covers.size() ? GroundCover::sheet : GroundCover::table;
    std::size_t at = 0;
    std::erase_if(ground.samples, [&](const GroundSample&) { return covers[at++] != kept; });
    return;
  }
  const double ratio = order_statistic(ratios, ratios.size() / 2);
  for (std::size_t i = 0; i < covers.size(); ++i) {
    if (covers[i] != GroundCover::sheet) continue;
    GroundSample& sample = ground.samples[i];
    sample.radiance *= ratio, sample.sigma *= ratio, sample.table_ratio = ratio;
  }
}

}  // namespace lightwell::marker
