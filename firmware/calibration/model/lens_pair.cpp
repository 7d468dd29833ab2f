#include "calibration/model/lens_pair.hpp"

#include <cmath>
#include <string>

#include <lightwell/calibration.hpp>

namespace lightwell {

namespace {

// Tolerance of orthonormality: files have at least seven digits.
constexpr double kOrthonormal = 1e-4;

/// Shepperd 1978: divides by the largest of the four components, which is well away from zero.
Quat quaternion_of(const std::array<Vec3d, 3>& m) {
  const double x = m[0].x, y = m[1].y, z = m[2].z, trace = x + y + z;
  Quat q;
  if (trace >= x && trace >= y && trace >= z) {
    q = {m[2].y - m[1].z, m[0].z - m[2].x, m[1].x - m[0].y, 1 + trace};
  } else if (x >= y && x >= z) {
    q = {1 + x - y - z, m[0].y + m[1].x, m[0].z + m[2].x, m[2].y - m[1].z};
  } else if (y >= z) {
    q = {m[0].y + m[1].x, 1 - x + y - z, m[1].z + m[2].y, m[0].z - m[2].x};
  } else {
    q = {m[0].z + m[2].x, m[1].z + m[2].y, 1 - x - y + z, m[1].x - m[0].y};
  }
  return q.normalized();
}

}  // namespace

Result<Pose> pose_of(const std::vector<std::vector<double>>& rows) {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  if (rows.size() != 4) return bad("must be 4 x 4 numbers, it has " + std::to_string(rows.size()) + " rows");
  for (const auto& row : rows) {
    if (row.size() != 4) return bad("must be 4 x 4 numbers, a row has " + std::to_string(row.size()));
    for (const double v : row)
      if (!std::isfinite(v)) return bad("has a value that is not finite");
  }
  if (rows[3] != std::vector<double>{0, 0, 0, 1}) return bad("the last row must be 0 0 0 1");
  std::array<Vec3d, 3> m;
  for (std::size_t i = 0; i < 3; ++i) m[i] = {rows[i][0], rows[i][1], rows[i][2]};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j)
      if (!(std::abs(dot(m[i], m[j]) - (i == j ? 1 : 0)) < kOrthonormal))
        return bad("is no rotation: its rows are not unit vectors at right angles");
  if (dot(m[0], cross(m[1], m[2])) < 0) return bad("mirrors: its determinant is -1");
  return Pose{quaternion_of(m), {rows[0][3], rows[1][3], rows[2][3]}};
}

std::array<Pose, 2> pair_in_probe(const Pose& second_from_first) {
  const Quat first_from_second = second_from_first.rotation.inverse();
  // Position of lens 1 in lens 0's frame.
  const Vec3d place = -rotate(first_from_second, second_from_first.translation);
  const Vec3d half = rotate(upright_lens_cv(), place) * 0.5;
  return {Pose{upright_lens_cv(), -half}, Pose{(upright_lens_cv() * first_from_second).normalized(), half}};
}

double angle_between_axes(const Pose& second_from_first) {
  return angle_between(Vec3d{0, 0, 1}, rotate(second_from_first.rotation, Vec3d{0, 0, 1}));
}

}  // namespace lightwell
