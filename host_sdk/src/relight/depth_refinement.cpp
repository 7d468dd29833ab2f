// Depth from measured depth and photometric normals.
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include <lightwell/relight_capture.hpp>

#include "relight/subject.hpp"

namespace lightwell {
namespace relight {
namespace {

constexpr int kMaxIterations = 400;
constexpr double kTolerance = 1e-7;

/// Mean of vectors over squares of 2 `radius` + 1 pixels, by running sums over rows, then columns.
std::vector<Vec3d> box_blur(std::span<const Vec3f> in, int columns, int rows, int radius) {
  std::vector<Vec3d> across(in.size()), out(in.size());
  const auto blur = [&](auto&& from, std::vector<Vec3d>& to, int count, int lines, std::size_t stride,
                        std::size_t line_stride) {
    for (int line = 0; line < lines; ++line) {
      const std::size_t first = static_cast<std::size_t>(line) * line_stride;
      const auto at = [&](int i) { return from(first + static_cast<std::size_t>(i) * stride); };
      Vec3d sum;
      for (int i = 0; i < std::min(radius, count); ++i) sum += at(i);
      for (int i = 0; i < count; ++i) {
        if (i + radius < count) sum += at(i + radius);
        if (i > radius) sum += -at(i - radius - 1);
        to[first + static_cast<std::size_t>(i) * stride] = sum;
      }
    }
  };
  const auto width = static_cast<std::size_t>(columns);
  blur([&](std::size_t p) { return vec_cast<double>(in[p]); }, across, columns, rows, 1, width);
  blur([&](std::size_t p) { return across[p]; }, out, rows, columns, width, 1);
  return out;
}

/// v turned by the rotation that takes unit a to unit b the shortest way.
Vec3d turned(Vec3d v, Vec3d a, Vec3d b) {
  const Vec3d axis = cross(a, b);
  const double sine = length(axis);
  if (!(sine > 1e-12)) return v;
  return rotate(Quat::about(axis * (1 / sine), std::atan2(sine, dot(a, b))), v);
}

/// Normals whose means are those of the geometry (section 3.1 of the paper); the geometry's where none is known.
std::vector<Vec3d> corrected_normals(const SubjectData& subject, std::span<const Vec3f> normals, int radius) {
  std::vector<Vec3f> known(normals.begin(), normals.end());
  std::vector<Vec3f> facets = subject.facets;
  for (std::size_t p = 0; p < known.size(); ++p) {
    known[p] = subject.has_geometry(p) ? normalized(known[p]) : Vec3f{};
    // Means over the same pixels.
    if (!(dot(known[p], known[p]) > 0)) facets[p] = {};
  }
  const auto smooth = box_blur(known, subject.camera.columns, subject.camera.rows, radius);
  const auto smooth_facets = box_blur(facets, subject.camera.columns, subject.camera.rows, radius);
  std::vector<Vec3d> out(known.size());
  for (std::size_t p = 0; p < out.size(); ++p) {
    const Vec3d normal = vec_cast<double>(known[p]);
    out[p] = dot(normal, normal) > 0 ? turned(normal, normalized(smooth[p]), normalized(smooth_facets[p]))
                                     : vec_cast<double>(subject.facets[p]);
  }
  return out;
}

}  // namespace
}  // namespace relight

Status DepthRefinementOptions::validate() const {
  if (!(depth_weight > 0 && depth_weight <= 1))
    return invalid_argument("depth refinement: depth_weight is " + std::to_string(depth_weight) +
                            ", it must be above 0, at most 1");
  if (smoothing_px < 1 || smoothing_px > 256)
    return invalid_argument("depth refinement: smoothing_px is " + std::to_string(smoothing_px) +
                            ", it must be 1 to 256");
  return {};
}

Result<std::vector<float>> refine_depth(const RelightSubject& subject, std::span<const Vec3f> normals,
                                        const DepthRefinementOptions& options) {
  if (Status status = options.validate(); !status.ok()) return status;
  const relight::SubjectData& data = subject.data();
  const std::size_t pixels = data.depth.size();
  if (Status status = relight::check_size("normals", normals.size(), pixels); !status.ok()) return status;
  for (std::size_t p = 0; p < pixels; ++p)
    if (!is_finite(normals[p])) return invalid_argument("normal of pixel " + std::to_string(p) + " is not finite");
  std::vector<float> out = data.depth;
  const std::size_t unknowns = pixels - data.without_geometry;
  if (unknowns == 0) return out;

  const std::vector<Vec3d> corrected = relight::corrected_normals(data, normals, options.smoothing_px);
  std::vector<int> index(pixels, -1);
  int next = 0;
  for (std::size_t p = 0; p < pixels; ++p)
    if (data.has_geometry(p)) index[p] = next++;
  // A point is eye + depth ray: errors of points and tangents are linear in the depths.
  const Vec3d eye = data.camera.T_world_camera.translation;
  const auto ray = [&](std::size_t p) {
    return (vec_cast<double>(data.positions[p]) - eye) * (1 / static_cast<double>(data.depth[p]));
  };
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(next), depth = right;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (index[p] < 0) continue;
    const Vec3d r = ray(p);
    const double weight = options.depth_weight * dot(r, r);
    depth[index[p]] = static_cast<double>(data.depth[p]);
    entries.emplace_back(index[p], index[p], weight);
    right[index[p]] += weight * depth[index[p]];
  }
  // The step to the neighbour is at a right angle to the normal between them.
  const auto tangent = [&](std::size_t a, std::size_t b) {
    if (!data.same_surface(a, b)) return;
    const Vec3d normal = normalized(corrected[a] + corrected[b]);
    const double ka = dot(normal, ray(a)), kb = dot(normal, ray(b)), weight = 1 - options.depth_weight;
    entries.emplace_back(index[a], index[a], weight * ka * ka);
    entries.emplace_back(index[b], index[b], weight * kb * kb);
    entries.emplace_back(index[a], index[b], -weight * ka * kb);
    entries.emplace_back(index[b], index[a], -weight * ka * kb);
  };
  const auto columns = static_cast<std::size_t>(data.camera.columns);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (p % columns + 1 < columns) tangent(p, p + 1);
    if (p + columns < pixels) tangent(p, p + columns);
  }
  Eigen::SparseMatrix<double> normal_equations(next, next);
  normal_equations.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setMaxIterations(relight::kMaxIterations);
  solver.setTolerance(relight::kTolerance);
  solver.compute(normal_equations);
  const Eigen::VectorXd refined = solver.solveWithGuess(right, depth);
  for (std::size_t p = 0; p < pixels; ++p)
    if (index[p] >= 0 && refined[index[p]] > 0) out[p] = static_cast<float>(refined[index[p]]);
  return out;
}

}  // namespace lightwell
