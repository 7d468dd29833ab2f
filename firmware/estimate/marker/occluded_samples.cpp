#include "estimate/marker/occluded_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

/// Largest residual of a sample relative to the median irradiance of its face, unless four robust standard deviations
/// of the face's residuals are more; four sigmas of the sample are added.
constexpr double kMaxPlaneDeviation = 0.03;

}  // namespace

int remove_occluded_samples(Shading& shading) {
  int outliers = 0;
  std::vector<SurfaceSample> inliers;
  for (std::size_t begin = 0; begin < shading.samples.size();) {
    std::size_t end = begin;
    while (end < shading.samples.size() && shading.samples[end].surface == shading.samples[begin].surface) ++end;
    const std::span<const SurfaceSample> face(shading.samples.data() + begin, end - begin);
    begin = end;
    const Vec3d normal = face[0].normal;
    const bool flat =
        std::all_of(face.begin(), face.end(), [&](const SurfaceSample& s) { return dot(s.normal, normal) > 0.9999; });
    if (!flat || face.size() < 6) {
      inliers.insert(inliers.end(), face.begin(), face.end());
      continue;
    }
    const auto [u, v] = tangent_basis(normal);
    struct Point {
      double u, v, value;
    };
    std::vector<Point> points;
    for (const SurfaceSample& s : face)
      points.push_back(
          {dot(s.position, u), dot(s.position, v), (s.irradiance[0] + s.irradiance[1] + s.irradiance[2]) / 3});
    std::vector<double> residuals(points.size()), best_residuals(points.size(), 0), sorted;
    double least_median = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = i + 1; j < points.size(); ++j)
        for (std::size_t k = j + 1; k < points.size(); ++k) {
          const Point &a = points[i], &b = points[j], &c = points[k];
          const double bu = b.u - a.u, bv = b.v - a.v, cu = c.u - a.u, cv = c.v - a.v, det = bu * cv - bv * cu;
          if (std::abs(det) < 0.1 * (bu * bu + bv * bv)) continue;
          const double gu = ((b.value - a.value) * cv - (c.value - a.value) * bv) / det;
          const double gv = ((c.value - a.value) * bu - (b.value - a.value) * cu) / det;
          for (std::size_t n = 0; n < points.size(); ++n)
            residuals[n] = std::abs(points[n].value - a.value - gu * (points[n].u - a.u) - gv * (points[n].v - a.v));
          sorted = residuals;
          const double typical = upper_quantile(sorted, 0.5);
          if (typical < least_median) least_median = typical, best_residuals = residuals;
        }
    sorted.clear();
    for (const Point& p : points) sorted.push_back(p.value);
    const double bound =
        std::max(kMaxPlaneDeviation * std::abs(upper_quantile(sorted, 0.5)), 4 * 1.4826 * least_median);
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (!(best_residuals[n] > bound + 4 * (face[n].sigma[0] + face[n].sigma[1] + face[n].sigma[2]) / 3))
        inliers.push_back(face[n]);
      else
        ++outliers;
    }
  }
  shading.samples = std::move(inliers);
  return outliers;
}

}  // namespace lightwell::marker
