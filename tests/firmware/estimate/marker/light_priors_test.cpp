// Priors of lights: derivatives against differences, one albedo of the table, nothing at all.
#include "estimate/marker/light_priors.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::LitBody;
using test::towards;

/// Two lights above a table, one of them near. Samples of three channels.
struct Case {
  Shading shading = LitBody{.lamps = {{towards(30, 40), 0, {1, 0.8, 0.6}}}, .table = true}.shading();
  Observations observations{shading};
  FitLayout layout{{Distance::free, Distance::infinite}, 3, true};
  std::vector<LightPose> start;

  Case() {
    for (const Vec3d direction : {towards(30, 40), towards(-120, 25)}) {
      const auto [u, v] = tangent_basis(direction);
      start.push_back({direction, u, v, 0});
    }
  }

  [[nodiscard]] Eigen::VectorXd residuals(const Eigen::VectorXd& p, RowMajor* jacobian = nullptr) const {
    const LightPriors priors(observations, layout, start);
    Eigen::VectorXd out = Eigen::VectorXd::Zero(priors.rows());
    if (jacobian == nullptr) {
      priors.evaluate(p.data(), out, nullptr);
      return out;
    }
    *jacobian = RowMajor::Zero(priors.rows(), layout.size);
    Eigen::Ref<RowMajor> rows = *jacobian;
    priors.evaluate(p.data(), out, &rows);
    return out;
  }

  /// Radiance and irradiance of the table in the same proportion for all light: ambient 0.5, lights 1 and 0.4.
  [[nodiscard]] Eigen::VectorXd one_albedo() const {
    Eigen::VectorXd p = Eigen::VectorXd::Zero(layout.size);
    const double albedo = 0.3;
    p[layout.ground] = albedo * 0.5;
    for (int c = 0; c < 3; ++c) p[layout.ambient + 4 * c] = 0.5;
    const std::vector<double> irradiances = {1, 0.4};
    for (std::size_t k = 0; k < 2; ++k) {
      p[layout.ground + 1 + static_cast<int>(k)] = albedo * irradiances[k];
      for (int c = 0; c < 3; ++c) p[layout.lights[k].irradiance + c] = irradiances[k];
    }
    return p;
  }
};

TEST(LightPriors, DerivativesAgreeWithDifferences) {
  const Case one;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::VectorXd p(one.layout.size);
    for (double& v : p) v = 0.2 + unit(random);
    for (const FitLayout::LightParameters& offsets : one.layout.lights)
      p[offsets.turn] = 0.2 * unit(random), p[offsets.turn + 1] = -0.2 * unit(random);
    RowMajor jacobian;
    (void)one.residuals(p, &jacobian);
    for (int i = 0; i < one.layout.size; ++i) {
      constexpr double kStep = 1e-6;
      Eigen::VectorXd above = p, below = p;
      above[i] += kStep, below[i] -= kStep;
      const Eigen::VectorXd slope = (one.residuals(above) - one.residuals(below)) / (2 * kStep);
      // Central differences of residuals up to 10: rounding 1e-9, third derivatives below 1e-8.
      for (Eigen::Index row = 0; row < slope.size(); ++row)
        EXPECT_NEAR(jacobian(row, i), slope[row], 1e-6 * (1 + std::abs(slope[row]))) << row << ", " << i;
    }
  }
}

TEST(LightPriors, OneAlbedoCostsNothing) {
  const Case one;
  Eigen::VectorXd p = one.one_albedo();
  const auto of_albedo = [&] { return Eigen::Vector3d(one.residuals(p).tail<3>()); };
  EXPECT_LT(of_albedo().cwiseAbs().maxCoeff(), 1e-9);
  // A light whose shadow is twice as deep as its irradiance says reflects a larger share than all others.
  p[one.layout.ground + 1] *= 2;
  EXPECT_GT(of_albedo()[1], 1);
  EXPECT_LT(of_albedo()[0], 0);
  EXPECT_LT(of_albedo()[2], 0);
}

TEST(LightPriors, NothingAtAllIsFinite) {
  const Case one;
  RowMajor jacobian;
  EXPECT_TRUE(one.residuals(Eigen::VectorXd::Zero(one.layout.size), &jacobian).allFinite());
  EXPECT_TRUE(jacobian.allFinite());
}

}  // namespace
}  // namespace lightwell::marker
