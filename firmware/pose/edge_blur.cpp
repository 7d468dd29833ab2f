#include "pose/edge_blur.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include <Eigen/Dense>

#include "pose/normal_table.hpp"

namespace lightwell {
namespace {

/// Between the samples of a profile.
constexpr double kStep_px = 0.5;
/// Half the length of the profile relative to a cell: not as far as the steps two cells away. The largest in pixels is
/// twice kMaxEdgeBlur_px: what is farther away does not distinguish blurs.
constexpr double kReach_cells = 1.2, kMaxReach_px = 2 * kMaxEdgeBlur_px;
constexpr std::size_t kMaxHalf = static_cast<std::size_t>(kMaxReach_px / kStep_px);
constexpr int kMaxLines = 48, kMinLines = 4;
/// Smallest difference between both sides of the edge, in steps of the pixel values.
constexpr double kMinContrast = 5;
/// Variance that a pixel's area (1/12) and bilinear interpolation (1/6 in the mean) add in any direction, px².
constexpr double kSamplingVariance = 0.25;
/// Total standard deviations that are tried: that of sampling alone, then in equal ratios. A parabola through three
/// neighbours interpolates to some hundredths of a pixel.
constexpr double kSharpest_px = 0.5, kRatio = 1.3;
constexpr int kWidths = 9;  // up to 4.08 px
/// Prior standard deviations: of the profile's residuals relative to the edge (noise, JPEG, uneven light), of the steps
/// beside the edge relative to it (inwards half of the cells are of the other colour, outwards is paper), and of the
/// shift of the traced edge. Without them, steps that compensate each other would imitate any smooth profile.
constexpr double kResidualSigma = 0.01, kBesideSigma = 0.5, kShiftSigma_px = 0.5;

/// The mean values along the edge at distances kStep_px * (i - half) from it.
struct Profile {
  std::array<double, 2 * kMaxHalf + 1> values{};
  std::size_t half = 0;
};

std::optional<Profile> mean_profile(const LinearPicture& picture, const Edge& edge) {
  Profile out;
  out.half = static_cast<std::size_t>(std::min(kReach_cells * edge.cell, kMaxReach_px) / kStep_px);
  if (out.half < 2) return std::nullopt;
  const std::size_t count = 2 * out.half + 1;
  std::array<double, 2 * kMaxHalf + 1> line;
  const int lines = std::clamp(static_cast<int>(edge.end - edge.begin), kMinLines, kMaxLines);
  for (int i = 0; i < lines; ++i) {
    const double s = edge.begin + (edge.end - edge.begin) * i / (lines - 1);
    const Eigen::Vector2d first = edge.at(s) - edge.out * (kStep_px * static_cast<double>(out.half));
    if (!picture.along(first, edge.out * kStep_px, std::span(line).first(count))) return std::nullopt;
    for (std::size_t k = 0; k < count; ++k) out.values[k] += line[k] / lines;
  }
  return out;
}

struct ProfileFit {
  double cost = std::numeric_limits<double>::infinity();  ///< Sum of squared residuals.
  double step = 0;                                        ///< Change at the edge, outwards.
};

/// Least squares of the profile: constant, step at the edge, steps one cell inwards and outwards, and a small shift of
/// the edge, each blurred by `sigma`.
ProfileFit fit_profile(const Profile& profile, double cell, double sigma) {
  using Row = Eigen::Matrix<double, 5, 1>;
  const NormalTable& normal = normal_table();
  Eigen::Matrix<double, 5, 5> information = Eigen::Matrix<double, 5, 5>::Zero();
  Row right = Row::Zero();
  double squares = 0;
  for (std::size_t k = 0; k < 2 * profile.half + 1; ++k) {
    const double d = kStep_px * (static_cast<double>(k) - static_cast<double>(profile.half));
    const auto [share, density] = normal.at(d / sigma);
    const Row row(1, share, normal.at((-d - cell) / sigma).integral, normal.at((d - cell) / sigma).integral, density);
    information += row * row.transpose();
    right += row * profile.values[k];
    squares += profile.values[k] * profile.values[k];
  }
  const auto expect_zero = [&](const Row& combination, double relative_sigma) {
    information += std::pow(kResidualSigma / relative_sigma, 2) * combination * combination.transpose();
  };
  expect_zero(Row(0, -0.5, 1, 0, 0), kBesideSigma);
  expect_zero(Row(0, 0, 0, 1, 0), kBesideSigma);
  expect_zero(Row(0, 0, 0, 0, 1), kShiftSigma_px / sigma);
  const Row x = information.ldlt().solve(right);
  if (!x.allFinite()) return {};
  return {std::max(0.0, squares - x.dot(right)), x[1]};
}

}  // namespace

std::optional<double> measure_blur(const LinearPicture& picture, const Edge& edge, double sign) {
  const std::optional<Profile> profile = mean_profile(picture, edge);
  if (!profile) return std::nullopt;
  std::array<ProfileFit, kWidths> fits;
  std::size_t best = 0;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    fits[k] = fit_profile(*profile, edge.cell, kSharpest_px * std::pow(kRatio, static_cast<double>(k)));
    if (fits[k].cost < fits[best].cost) best = k;
  }
  const double level = profile->values[profile->half];
  if (!(sign * fits[best].step > kMinContrast * picture.step_at(level))) return std::nullopt;
  double exponent = static_cast<double>(best);
  if (best > 0 && best + 1 < fits.size()) {
    const double before = fits[best - 1].cost, here = fits[best].cost, after = fits[best + 1].cost;
    const double bend = before - 2 * here + after;
    if (bend > 0) exponent += 0.5 * (before - after) / bend;
  }
  const double total = kSharpest_px * std::pow(kRatio, exponent);
  return std::min(std::sqrt(std::max(0.0, total * total - kSamplingVariance)), kMaxEdgeBlur_px);
}

}  // namespace lightwell
