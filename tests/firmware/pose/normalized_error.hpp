// Error of a pose relative to its covariance.
#pragma once

#include <array>

#include <Eigen/Dense>

#include <lightwell/uncertain_pose.hpp>

namespace lightwell::test {

/// e' C⁻¹ e / 6.
inline double normalized_error(const std::array<double, 6>& e, const PoseCovariance& c) {
  Eigen::Matrix<double, 6, 6> m;
  Eigen::Matrix<double, 6, 1> v;
  for (std::size_t r = 0; r < 6; ++r) {
    v[static_cast<Eigen::Index>(r)] = e[r];
    for (std::size_t k = 0; k < 6; ++k) m(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(k)) = c[r][k];
  }
  return v.dot(m.ldlt().solve(v)) / 6;
}

}  // namespace lightwell::test
