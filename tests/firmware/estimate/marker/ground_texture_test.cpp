// Whitening of a plane's texture and smooth variation against the dense covariance, and textures found again from their
// own draws.
#include "estimate/marker/ground_texture.hpp"

#include <algorithm>
#include <array>
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

/// Standard deviations of the smooth terms u, v, u², u v, v², relative to the mean radiance.
constexpr std::array kSmoothSigma = {0.25, 0.25, 0.15, 0.15, 0.15};

/// The smooth terms times their standard deviations: S of the covariance S S'. Coordinates are from the middle of the
/// samples, relative to the largest distance from there.
Eigen::MatrixXd smooth_terms(const Grid& grid) {
  const Eigen::Index n = grid.u.size();
  Eigen::MatrixXd out(n, 5);
  double reach = 0;
  for (Eigen::Index i = 0; i < n; ++i)
    reach = std::max(reach, std::hypot(grid.u[i] - grid.u.mean(), grid.v[i] - grid.v.mean()));
  for (Eigen::Index i = 0; i < n; ++i) {
    const double u = reach > 0 ? (grid.u[i] - grid.u.mean()) / reach : 0,
                 v = reach > 0 ? (grid.v[i] - grid.v.mean()) / reach : 0;
    const std::array terms = {u, v, u * u, u * v, v * v};
    for (std::size_t k = 0; k < terms.size(); ++k) out(i, static_cast<Eigen::Index>(k)) = kSmoothSigma[k] * terms[k];
  }
  return out;
}

/// Own variance and texture.
Eigen::MatrixXd texture_covariance(const Grid& grid, const GroundTexture& texture, const Eigen::ArrayXd& own_variance) {
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

Eigen::MatrixXd covariance(const Grid& grid, const GroundTexture& texture, const Eigen::ArrayXd& own_variance) {
  const Eigen::MatrixXd s = smooth_terms(grid);
  return texture_covariance(grid, texture, own_variance) + s * s.transpose();
}

Eigen::VectorXd normal_deviates(Eigen::Index n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd out(n);
  for (double& x : out) x = normal(random);
  return out;
}

void expect_exact(const Grid& grid, const GroundTexture& texture, const Eigen::ArrayXd& own, const char* what) {
  const Eigen::Index n = grid.u.size();
  const GroundNeighbours neighbours(grid.u, grid.v);
  const GroundWhitening with(neighbours, own, texture);
  const Eigen::LLT<Eigen::MatrixXd> dense(covariance(grid, texture, own));
  const Eigen::MatrixXd inverse = dense.solve(Eigen::MatrixXd::Identity(n, n));
  Eigen::MatrixXd whitening = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index k = 0; k < n; ++k) with.whiten(whitening.col(k));
  // The variance of 1e-12 that is added is at most 1e-8 of the smallest conditional one.
  EXPECT_NEAR((whitening.transpose() * whitening - inverse).norm(), 0, 1e-7 * inverse.norm()) << what;
  EXPECT_NEAR(with.log_determinant(), 2 * dense.matrixLLT().diagonal().array().log().sum(), 1e-6) << what;
  const Eigen::VectorXd x = normal_deviates(n, 2);
  const Eigen::MatrixXd s = smooth_terms(grid);
  EXPECT_NEAR((with.smooth_part(x) - s * s.transpose() * inverse * x).norm(), 0, 1e-7 * x.norm()) << what;
}

TEST(GroundTexture, WhiteningOfUncorrelatedSamplesIsExact) {
  const Grid grid(5);
  const GroundTexture white{.sigma = 0.1, .correlated = 0};
  expect_exact(grid, white, Eigen::ArrayXd::LinSpaced(25, 0, 0.02), "own variances");
  expect_exact(grid, {.sigma = 0.01, .correlated = 0}, Eigen::ArrayXd::Zero(25), "small noise: the terms dominate");
  Grid line = grid;
  line.v = 0.3;
  expect_exact(line, white, Eigen::ArrayXd::LinSpaced(25, 0, 0.02), "a line: three terms do not vary");
}

TEST(GroundTexture, SmoothBrightnessIsSeparatedFromNoise) {
  const Grid grid(20);
  const GroundNeighbours neighbours(grid.u, grid.v);
  const GroundWhitening whitening(neighbours, Eigen::ArrayXd::Zero(400), {.sigma = 0.05, .correlated = 0});
  const Eigen::VectorXd gradient = smooth_terms(grid) * Eigen::VectorXd::Unit(5, 0) * 2;
  // The noise leaves the five coefficients an error of 0.05 * sqrt(5 / 400) per sample; 3 times that.
  const Eigen::VectorXd error = whitening.smooth_part(gradient + 0.05 * normal_deviates(400, 4)) - gradient;
  EXPECT_LT(std::sqrt(error.squaredNorm() / 400), 3 * 0.05 * std::sqrt(5.0 / 400));
  // It costs the likelihood of two standard deviations of one coefficient.
  Eigen::VectorXd white = gradient;
  whitening.whiten(white);
  EXPECT_LT(white.squaredNorm(), 4);
}

TEST(GroundTexture, WithoutSmoothVariationWhiteningDividesBySigma) {
  for (const Eigen::Index n : {0, 1, 30}) {
    // All samples at one place.
    const GroundNeighbours neighbours(Eigen::ArrayXd::Constant(n, 0.2), Eigen::ArrayXd::Constant(n, -0.1));
    const GroundWhitening whitening(neighbours, Eigen::ArrayXd::Constant(n, 0.03), {.sigma = 0.1, .correlated = 0});
    const Eigen::VectorXd x = normal_deviates(n, 1);
    Eigen::VectorXd white = x;
    whitening.whiten(white);
    // Relative tolerance of the variance of 1e-12 that is added.
    EXPECT_LE((white - x / 0.2).norm(), 1e-9 * x.norm()) << n;
    EXPECT_NEAR(whitening.log_determinant(), static_cast<double>(n) * std::log(0.04), 1e-8) << n;
    EXPECT_LE(whitening.smooth_part(x).norm(), 1e-9 * x.norm()) << n;
  }
}

TEST(GroundTexture, WhiteningOfSevenSamplesIsTheExactFactor) {
  // Each of seven samples is conditioned on all earlier ones: the approximation is exact.
  Grid grid(3);
  grid.u.conservativeResize(7), grid.v.conservativeResize(7);
  const Eigen::ArrayXd own = Eigen::ArrayXd::LinSpaced(7, 0.001, 0.01);
  const GroundTexture texture{.sigma = 0.2, .correlated = 0.9, .length_m = 0.03};
  expect_exact(grid, texture, own, "seven samples");
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
      const Eigen::LLT<Eigen::MatrixXd> dense(texture_covariance(grid, truth, own));
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

/// A draw of a texture about a mean radiance of 1.
Eigen::VectorXd texture_draw(const Grid& grid, const GroundTexture& texture) {
  const Eigen::ArrayXd own = Eigen::ArrayXd::Constant(grid.u.size(), 1e-6);
  return Eigen::LLT<Eigen::MatrixXd>(texture_covariance(grid, texture, own)).matrixL() *
         normal_deviates(grid.u.size(), 5);
}

TEST(GroundLikelihood, AShadowThatIsLeftInTheResidualsIsLessLikely) {
  const Grid grid(15);
  const GroundNeighbours neighbours(grid.u, grid.v);
  const GroundLikelihood likelihood(neighbours, Eigen::ArrayXd::Constant(grid.u.size(), 1e-6), kStep_m);
  Eigen::VectorXd shadow(grid.u.size());
  for (Eigen::Index i = 0; i < grid.u.size(); ++i)
    shadow[i] = std::hypot(grid.u[i] - 0.05, grid.v[i] - 0.07) < 0.025 ? -0.3 : 0;
  for (const double sigma : {0.01, 0.03, 0.1}) {
    const Eigen::VectorXd texture = texture_draw(grid, {sigma, 0.9, 0.05});
    // Twice the logarithm of the price of the six parameters of a light, by BIC.
    EXPECT_GT(likelihood.deviance(texture + shadow) - likelihood.deviance(texture), 6 * std::log(225)) << sigma;
  }
}

TEST(GroundLikelihood, GrowsWithTheLogarithmOfTheResiduals) {
  const Grid grid(15);
  const GroundNeighbours neighbours(grid.u, grid.v);
  const GroundLikelihood likelihood(neighbours, Eigen::ArrayXd::Constant(grid.u.size(), 1e-8), kStep_m);
  const Eigen::VectorXd texture = texture_draw(grid, {0.01, 0.9, 0.05});
  // The smooth variation does not grow with the texture: it takes up to five of 225 degrees of freedom.
  EXPECT_NEAR((likelihood.deviance(4 * texture) - likelihood.deviance(texture)) / (2 * 225 * std::log(4)), 1, 0.05);
}

TEST(GroundLikelihood, DegenerateInputStaysFinite) {
  for (const int edge : {1, 2, 4}) {
    const Grid grid(edge);
    const GroundNeighbours neighbours(grid.u, grid.v);
    const GroundLikelihood likelihood(neighbours, Eigen::ArrayXd::Zero(grid.u.size()), kStep_m);
    for (const double value : {0.0, 1.0, 1e6})
      EXPECT_TRUE(std::isfinite(likelihood.deviance(Eigen::VectorXd::Constant(grid.u.size(), value))))
          << edge << ", " << value;
  }
}

}  // namespace
}  // namespace lightwell::marker
