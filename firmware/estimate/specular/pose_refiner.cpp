#include "estimate/specular/pose_refiner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "estimate/specular/plane_motion.hpp"

namespace lightwell::specular {
namespace {

/// Detail of a plain surface relative to its brightness: noise.
constexpr double kPlainDetail = 0.02;
/// Fewer texels or tiles do not determine six parameters and outliers.
constexpr int kMinTexels = 64;

/// Largest squared Mahalanobis distance of a pose from the prior: of a normal distribution of six dimensions one in
/// 10,000 is beyond 28. Twice that, because the texture's own place is as uncertain as the prior's at first. Where the
/// picture is saturated but for a few texels, these may agree with a pose that is centimetres off.
constexpr double kMaxSquaredDistance = 56;

/// Texels that are summed side by side, and sums: 21 of the information matrix, 6 of the gradient.
constexpr std::size_t kLanes = 8, kSums = 21 + 6;

/// Difference of detail_at(), mean absolute, relative to the detail of `predicted`
/// and a share of its brightness. A highlight that is not predicted is smooth and hardly counts. Infinite where nothing
/// can be compared.
double relative_error(const std::vector<float>& observed, const std::vector<float>& predicted, int edge) {
  double difference = 0, detail = 0, brightness = 0;
  const auto width = static_cast<std::size_t>(edge);
  for (std::size_t j = 1; j + 1 < width; ++j)
    for (std::size_t k = j * width + 1; k + 1 < (j + 1) * width; ++k) {
      const float of_predicted = detail_at(predicted, width, k), d = detail_at(observed, width, k) - of_predicted;
      if (!(d == d)) continue;
      difference += static_cast<double>(std::abs(d));
      detail += static_cast<double>(std::abs(of_predicted));
      brightness += static_cast<double>(predicted[k]);
    }
  const double scale = detail + kPlainDetail * brightness;
  return scale > 0 ? difference / scale : std::numeric_limits<double>::infinity();
}

/// Edge of the cells in which a picture has detail, in texels: 1, 2 or kTileEdge. `pixel_m`: length of a pixel on the
/// plane where it is longest.
int detail_cell(double pixel_m, double texel_m) {
  if (pixel_m < 1.5 * texel_m) return 1;
  return pixel_m < 3 * texel_m ? 2 : kTileEdge;
}

}  // namespace

struct PoseRefiner::Step {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  int texels = 0;
};

void PoseRefiner::reduce(int cell) {
  const auto full = static_cast<std::size_t>(texels_.edge), edge = full / static_cast<std::size_t>(cell);
  predicted_.assign(edge * edge, 0.0F);
  const float scale = 1 / static_cast<float>(cell * cell);
  const auto size = static_cast<std::size_t>(cell);
  for (std::size_t row = 0; row < full; ++row) {
    const float* in = &predicted_texels_[row * full];
    float* out = &predicted_[row / size * edge];
    for (std::size_t i = 0; i < edge; ++i) {
      float sum = 0;
      for (std::size_t x = 0; x < size; ++x) sum += in[i * size + x];
      out[i] += scale * sum;
    }
  }
}

PoseRefiner::Step PoseRefiner::step(int cell, Vec3d lens) const {
  Step out;
  const auto edge = static_cast<std::size_t>(texels_.edge / cell);
  const double cell_m = texels_.texel_m() * cell;
  double absolute = 0;
  int count = 0;
  for (std::size_t k = 0; k < predicted_.size(); ++k) {
    const float r = observed_[k] - predicted_[k];
    if (r == r) absolute += static_cast<double>(std::abs(r)), ++count;
  }
  if (count == 0) return out;
  out.texels = count;
  // Tukey's biweight at 4.685 sigma (Huber 1981); the mean absolute deviation of a normal distribution is 0.8 sigma.
  const double sigma = 1.25 * absolute / count;
  // An exact match has nothing to align.
  if (!(sigma > 0)) return out;
  const auto inverse_reach = static_cast<float>(1 / (4.685 * sigma)), half = static_cast<float>(0.25 / cell_m);
  // Sums of a row in lanes, so that loops vectorise: the lower triangle of the information, then the gradient.
  std::array<std::array<float, kLanes>, kSums> sums;
  std::array<double, kSums> total{};
  for (std::size_t j = 1; j + 1 < edge; ++j) {
    for (auto& lanes : sums) lanes.fill(0);
    const double y_m = (0.5 * static_cast<double>(edge) - static_cast<double>(j) - 0.5) * cell_m;
    const auto y = static_cast<float>(y_m), sy = static_cast<float>((lens.y - y_m) / lens.z);
    const auto lens_x = static_cast<float>(lens.x), inverse_z = static_cast<float>(1 / lens.z);
    const auto x0 = static_cast<float>((0.5 - 0.5 * static_cast<double>(edge)) * cell_m);
    for (std::size_t first = 1; first + 1 < edge; first += kLanes) {
      // The last lanes of a row may lie outside: their index is clamped and their weight is 0.
      std::array<std::array<float, kLanes>, 6> row;
      std::array<float, kLanes> weight, residual;
      for (std::size_t n = 0; n < kLanes; ++n) {
        const std::size_t i = std::min(first + n, edge - 2), at = j * edge + i;
        const float* o = &observed_[at];
        const float* p = &predicted_[at];
        residual[n] = o[0] - p[0];
        // Mean gradient of observation and prediction, by central differences.
        const float across = o[1] - o[-1] + p[1] - p[-1];
        const float upward =
            o[-static_cast<std::ptrdiff_t>(edge)] - o[edge] + p[-static_cast<std::ptrdiff_t>(edge)] - p[edge];
        const float u = residual[n] * inverse_reach, biweight = 1 - u * u;
        const float check = residual[n] + across + upward;
        const bool valid = check == check && biweight > 0 && first + n == i;
        weight[n] = valid ? biweight * biweight : 0.0F;
        residual[n] = valid ? residual[n] : 0.0F;
        const float gx = valid ? across * half : 0.0F, gy = valid ? upward * half : 0.0F;
        const float x = x0 + static_cast<float>(static_cast<int>(i)) * static_cast<float>(cell_m);
        // A point that leaves the plane by z is seen where its ray meets the plane: displaced by -z (lens - point) /
        // lens.z.
        const float out_of_plane = -(gx * ((lens_x - x) * inverse_z) + gy * sy);
        row[0][n] = out_of_plane * y, row[1][n] = -out_of_plane * x, row[2][n] = gy * x - gx * y;
        row[3][n] = gx, row[4][n] = gy, row[5][n] = out_of_plane;
      }
      std::size_t sum = 0;
      for (std::size_t a = 0; a < 6; ++a) {
        std::array<float, kLanes> weighted;
        for (std::size_t n = 0; n < kLanes; ++n) weighted[n] = weight[n] * row[a][n];
        for (std::size_t b = 0; b <= a; ++b, ++sum)
          for (std::size_t n = 0; n < kLanes; ++n) sums[sum][n] += weighted[n] * row[b][n];
        for (std::size_t n = 0; n < kLanes; ++n) sums[21 + a][n] += weighted[n] * residual[n];
      }
    }
    for (std::size_t k = 0; k < kSums; ++k)
      for (const float lane : sums[k]) total[k] += static_cast<double>(lane);
  }
  // Errors of neighbouring texels are correlated (interpolation, errors of the texture): a tenth of them count.
  const double scale = 0.1 / (sigma * sigma);
  std::size_t sum = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b <= a; ++b, ++sum) out.information(a, b) = out.information(b, a) = scale * total[sum];
    out.gradient[a] = scale * total[21 + static_cast<std::size_t>(a)];
  }
  return out;
}

RefinedPose PoseRefiner::refine(PlaneWarp& warp, const UncertainPose& prior, const std::optional<Pose>& other,
                                const TexelImage& predicted, TexelImage& image) {
  RefinedPose out;
  predicted_texels_.resize(predicted.size());
  for (std::size_t k = 0; k < predicted.size(); ++k)
    predicted_texels_[k] = predicted[k].clipped == 0 ? predicted[k].luminance() : kMissing;
  reduce(kTileEdge);
  warp.sample_luminance(prior.pose, kTileEdge, observed_);
  out.error_before = relative_error(observed_, predicted_, texels_.tiles());
  out.probe_plane = prior.pose;
  const Matrix6 information = motion_covariance(prior).inverse();
  const auto is_near_prior = [&](const Pose& pose) {
    const Vector6 motion = logarithm(compose(inverse(prior.pose), pose));
    return motion.dot(information * motion) < kMaxSquaredDistance;
  };
  if (other && is_near_prior(*other)) {
    warp.sample_luminance(*other, kTileEdge, observed_);
    const double error = relative_error(observed_, predicted_, texels_.tiles());
    if (error < out.error_before) {
      out.error_before = error;
      out.probe_plane = *other;
    }
  }
  const int fine = detail_cell(warp.pixel_on_plane(prior.pose), texels_.texel_m());
  Pose best = out.probe_plane;
  int reduced = kTileEdge;
  for (int k = 0; k < options_.tile_steps + options_.texel_steps; ++k) {
    const int cell = k < options_.tile_steps ? kTileEdge : fine;
    if (cell != reduced) reduce(reduced = cell);
    warp.sample_luminance(best, cell, observed_);
    const Step now = step(cell, warp.lens_in_plane(best));
    if (now.texels < kMinTexels) break;
    out.texels = now.texels;
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t c = 0; c < 6; ++c)
        out.information[r][c] = now.information(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
    // The prior pulls the total motion back to zero.
    const Vector6 total = logarithm(compose(inverse(prior.pose), best));
    const Vector6 motion = (now.information + information).ldlt().solve(-now.gradient - information * total);
    if (!motion.allFinite()) break;
    best = compose(best, exponential(motion));
    best.rotation = best.rotation.normalized();
  }
  if (reduced != kTileEdge) reduce(kTileEdge);
  warp.sample_luminance(best, kTileEdge, observed_);
  out.error_after = relative_error(observed_, predicted_, texels_.tiles());
  out.aligned = out.error_after <= out.error_before && is_near_prior(best);
  if (out.aligned) {
    out.probe_plane = best;
  } else {
    out.error_after = out.error_before;
  }
  warp.sample(out.probe_plane, image);
  return out;
}

}  // namespace lightwell::specular
