// Whitening of a plane's texture against the dense Cholesky factor, and textures found again from their own draws.
#include "estimate/marker/ground_texture.hpp"

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace lightwell::marker {
namespace {

constexpr double kStep_m = 0.01;

struct Grid {
  Eigen::ArrayXd u, v;

  explicit Grid(int edge) : u(edge * edge), v(edge * edge) {
    for (int i = 0; i < edge * edge; ++i) u[i] = i % edge * kStep_m, v[i] = i / edge * kStep_m;
  }
};

Eigen::MatrixXd covariance(const Grid& grid, const GroundTexture& texture, const Eigen::ArrayXd& own_variance) {
  const Eigen::Index n = grid.u.size();
  Eigen::MatrixXd out(n, n);
  const double variance = texture.sigma * texture.sigma;
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b) {
      const double distance = std::hypot(grid.u[a] - grid.u[b], grid.v[a] - grid.v[b]);
      out(a, b) =
          a == b ? variance + own_variance[a] : variance * texture.correlated * std::exp(-distance / texture.length_m);
    }
  return out;
}

Eigen::VectorXd normal_deviates(Eigen::Index n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd out(n);
  for (double& x : out) x = normal(random);
  return out;
}

TEST(GroundTexture, WhiteningOfUncorrelatedSamplesDividesBySigma) {
  const Grid grid(5);
  const GroundNeighbours neighbours(grid.u, grid.v);
  const Eigen::ArrayXd own = Eigen::ArrayXd::LinSpaced(25, 0, 0.02);
  const GroundWhitening whitening(neighbours, own, {.sigma = 0.1, .correlated = 0});
  const Eigen::VectorXd x = normal_deviates(25, 1);
  Eigen::VectorXd white = x;
  whitening.whiten(white);
  double log_determinant = 0;
  for (Eigen::Index i = 0; i < 25; ++i) {
    EXPECT_NEAR(white[i], x[i] / std::sqrt(0.01 + own[i]), 1e-6) << i;
    log_determinant += std::log(0.01 + own[i]);
  }
  EXPECT_NEAR(whitening.log_determinant(), log_determinant, 1e-6);
}

TEST(GroundTexture, WhiteningOfSevenSamplesIsTheExactFactor) {
  // Each of seven samples is conditioned on all earlier ones: the approximation is exact.
  Grid grid(3);
  grid.u.conservativeResize(7), grid.v.conservativeResize(7);
  const Eigen::ArrayXd own = Eigen::ArrayXd::LinSpaced(7, 0.001, 0.01);
  const GroundTexture texture{.sigma = 0.2, .correlated = 0.9, .length_m = 0.03};
  const GroundNeighbours neighbours(grid.u, grid.v);
  const GroundWhitening with(neighbours, own, texture);
  const Eigen::LLT<Eigen::MatrixXd> dense(covariance(grid, texture, own));
  const Eigen::VectorXd x = normal_deviates(7, 2);
  Eigen::VectorXd white = x;
  with.whiten(white);
  // 1e-9: the variance of 1e-12 that is added, relative to the smallest conditional one.
  EXPECT_NEAR((white - dense.matrixL().solve(x)).norm(), 0, 1e-9);
  EXPECT_NEAR(with.log_determinant(), 2 * dense.matrixLLT().diagonal().array().log().sum(), 1e-8);
}

TEST(GroundTexture, WhitenedDrawsHaveUnitVariance) {
  const Grid grid(20);
  const GroundNeighbours neighbours(grid.u, grid.v);
  const Eigen::ArrayXd own = Eigen::ArrayXd::Constant(400, 1e-4);
  for (const double length : {0.5, 2.0, 6.0}) {
    const GroundTexture texture{.sigma = 0.1, .correlated = 0.9, .length_m = length * kStep_m};
    const GroundWhitening whitening(neighbours, own, texture);
    const Eigen::LLT<Eigen::MatrixXd> dense(covariance(grid, texture, own));
    double sum = 0;
    constexpr int kDraws = 20;
    for (unsigned seed = 0; seed < kDraws; ++seed) {
      Eigen::VectorXd x = dense.matrixL() * normal_deviates(400, seed);
      whitening.whiten(x);
      sum += x.squaredNorm() / 400 / kDraws;
    }
    // Each conditional variance is exact, so the mean is 1; 5 sigma of 8,000 squared deviates are 0.08.
    EXPECT_NEAR(sum, 1, 0.08) << length;
    // Six neighbours keep nearly all of the information.
    EXPECT_NEAR(whitening.log_determinant(), 2 * dense.matrixLLT().diagonal().array().log().sum(), 8) << length;
  }
}

TEST(GroundTexture, IsFoundAgainFromItsDraws) {
  const Grid grid(20);
  const GroundNeighbours neighbours(grid.u, grid.v);
  const Eigen::ArrayXd own = Eigen::ArrayXd::Zero(400);
  for (const double sigma : {0.01, 0.1}) {
    for (const double correlated : {0.0, 0.8}) {
      const GroundTexture truth{.sigma = sigma, .correlated = correlated, .length_m = 4 * kStep_m};
      const Eigen::LLT<Eigen::MatrixXd> dense(covariance(grid, truth, own));
      Eigen::VectorXd x = dense.matrixL() * normal_deviates(400, 3);
      for (Eigen::Index i = 0; i < 400; i += 37) x[i] += 20 * sigma;  // objects on the table
      const GroundTexture found = fit_ground_texture(neighbours, own, kStep_m, x);
      // A correlated texture has the information of some thirty samples: 13 % per standard deviation.
      EXPECT_NEAR(found.sigma / sigma, 1, 0.4) << sigma << " " << correlated;
      EXPECT_NEAR(found.correlated, correlated, 0.51) << sigma;
      EXPECT_EQ(found.correlated > 0, correlated > 0) << sigma;
    }
  }
}

TEST(GroundTexture, DegenerateInputStaysFinite) {
  for (const Eigen::Index n : {0, 1, 2, 50}) {
    // All samples at one point, all residuals equal.
    const GroundNeighbours neighbours(Eigen::ArrayXd::Zero(n), Eigen::ArrayXd::Zero(n));
    for (const double residual : {0.0, 1e-300, 1e6}) {
      const Eigen::VectorXd x = Eigen::VectorXd::Constant(n, residual);
      const GroundTexture texture = fit_ground_texture(neighbours, Eigen::ArrayXd::Zero(n), kStep_m, x);
      EXPECT_TRUE(texture.sigma > 0 && std::isfinite(texture.sigma)) << n << " " << residual;
      const GroundWhitening whitening(neighbours, Eigen::ArrayXd::Zero(n), texture);
      Eigen::VectorXd white = x;
      whitening.whiten(white);
      EXPECT_TRUE(white.allFinite() && std::isfinite(whitening.log_determinant())) << n << " " << residual;
    }
  }
}

}  // namespace
}  // namespace lightwell::marker
