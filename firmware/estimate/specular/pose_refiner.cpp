#include "estimate/specular/pose_refiner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimate/specular/plane_motion.hpp"

namespace lightwell::specular {
namespace {

/// Detail of a plain surface relative to its brightness: noise.
constexpr double kPlainDetail = 0.02;
/// Fewer texels or tiles do not determine six parameters and outliers.
constexpr int kMinTexels = 64;

constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();

/// Difference of detail (value minus mean of the four neighbours), mean absolute, relative to the detail of `predicted`
/// and a share of its brightness. A highlight that is not predicted is smooth and hardly counts. Infinite where nothing
/// can be compared.
double relative_error(const std::vector<float>& observed, const std::vector<float>& predicted, int edge) {
  double difference = 0, detail = 0, brightness = 0;
  const auto width = static_cast<std::size_t>(edge);
  const auto detail_at = [width](const std::vector<float>& v, std::size_t k) {
    return v[k] - 0.25F * (v[k - 1] + v[k + 1] + v[k - width] + v[k + width]);
  };
  for (std::size_t j = 1; j + 1 < width; ++j)
    for (std::size_t k = j * width + 1; k + 1 < (j + 1) * width; ++k) {
      const float of_predicted = detail_at(predicted, k), d = detail_at(observed, k) - of_predicted;
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
int detail_factor(double pixel_m, double texel_m) {
  if (pixel_m < 1.5 * texel_m) return 1;
  return pixel_m < 3 * texel_m ? 2 : kTileEdge;
}

}  // namespace

struct PoseRefiner::Level {
  const std::vector<float>& predicted;
  const std::vector<float>& observed;
  int edge;
  double cell_m;
};

struct PoseRefiner::Step {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  int texels = 0;
};

void PoseRefiner::reduce(const TexelImage& image, int factor, std::vector<float>& out) const {
  const int edge = texels_.edge / factor;
  out.resize(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge));
  for (int j = 0; j < edge; ++j)
    for (int i = 0; i < edge; ++i) {
      float sum = 0;
      bool complete = true;
      for (int y = 0; y < factor; ++y)
        for (int x = 0; x < factor; ++x) {
          const TexelRadiance& t = image[static_cast<std::size_t>((j * factor + y) * texels_.edge + i * factor + x)];
          complete = complete && t.measured();
          sum += t.luminance();
        }
      out[static_cast<std::size_t>(j * edge + i)] = complete ? sum / static_cast<float>(factor * factor) : kMissing;
    }
}

PoseRefiner::Step PoseRefiner::step(const Level& level, Vec3d lens) const {
  Step out;
  const int edge = level.edge;
  const auto at = [edge](const std::vector<float>& v, int i, int j) {
    return v[static_cast<std::size_t>(j * edge + i)];
  };
  double absolute = 0;
  int count = 0;
  for (std::size_t k = 0; k < level.predicted.size(); ++k) {
    const float r = level.observed[k] - level.predicted[k];
    if (r == r) absolute += static_cast<double>(std::abs(r)), ++count;
  }
  if (count == 0) return out;
  out.texels = count;
  // Tukey's biweight at 4.685 sigma (Huber 1981); the mean absolute deviation of a normal distribution is 0.8 sigma.
  const double sigma = 1.25 * absolute / count;
  // An exact match has nothing to align.
  if (!(sigma > 0)) return out;
  const double inverse_reach = 1 / (4.685 * sigma), half = 0.25 / level.cell_m;
  for (int j = 1; j + 1 < edge; ++j)
    for (int i = 1; i + 1 < edge; ++i) {
      const float residual = at(level.observed, i, j) - at(level.predicted, i, j);
      // Mean gradient of observation and prediction, by central differences.
      const float across = at(level.observed, i + 1, j) - at(level.observed, i - 1, j) + at(level.predicted, i + 1, j) -
                           at(level.predicted, i - 1, j);
      const float upward = at(level.observed, i, j - 1) - at(level.observed, i, j + 1) + at(level.predicted, i, j - 1) -
                           at(level.predicted, i, j + 1);
      const double check = static_cast<double>(residual + across + upward),
                   u = static_cast<double>(residual) * inverse_reach;
      if (!(check == check) || u * u >= 1) continue;
      const double weight = (1 - u * u) * (1 - u * u);
      const double gx = static_cast<double>(across) * half, gy = static_cast<double>(upward) * half;
      const double x = (i + 0.5 - 0.5 * edge) * level.cell_m, y = (0.5 * edge - j - 0.5) * level.cell_m;
      // A point that leaves the plane by z is seen where its ray meets the plane: displaced by -z (lens - point) /
      // lens.z.
      const double sx = (lens.x - x) / lens.z, sy = (lens.y - y) / lens.z, out_of_plane = -(gx * sx + gy * sy);
      Vector6 row;
      row << out_of_plane * y, -out_of_plane * x, gy * x - gx * y, gx, gy, out_of_plane;
      out.information.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
      out.gradient += weight * static_cast<double>(residual) * row;
    }
  // Errors of neighbouring texels are correlated (interpolation, errors of the texture): a tenth of them count.
  const double scale = 0.1 / (sigma * sigma);
  out.information = out.information.selfadjointView<Eigen::Lower>();
  out.information *= scale;
  out.gradient *= scale;
  return out;
}

RefinedPose PoseRefiner::refine(PlaneWarp& warp, const UncertainPose& prior, const std::optional<Pose>& other,
                                const TexelImage& predicted, TexelImage& image) {
  RefinedPose out;
  reduce(predicted, kTileEdge, predicted_);
  warp.sample_tiles(prior.pose, observed_);
  out.error_before = relative_error(observed_, predicted_, texels_.tiles());
  out.probe_plane = prior.pose;
  if (other) {
    warp.sample_tiles(*other, observed_);
    const double error = relative_error(observed_, predicted_, texels_.tiles());
    if (error < out.error_before) {
      out.error_before = error;
      out.probe_plane = *other;
    }
  }
  const Matrix6 information = motion_covariance(prior).inverse();
  const int fine = detail_factor(warp.pixel_on_plane(prior.pose), texels_.texel_m());
  Pose best = out.probe_plane;
  int reduced = kTileEdge;
  for (int k = 0; k < options_.tile_steps + options_.texel_steps; ++k) {
    const int factor = k < options_.tile_steps ? kTileEdge : fine;
    if (factor != reduced) reduce(predicted, reduced = factor, predicted_);
    if (factor == kTileEdge) {
      warp.sample_tiles(best, observed_);
    } else {
      warp.sample(best, image);
      reduce(image, factor, observed_);
    }
    const Step now =
        step({predicted_, observed_, texels_.edge / factor, texels_.texel_m() * factor}, warp.lens_in_plane(best));
    if (now.texels < kMinTexels) break;
    out.texels = now.texels;
    // The prior pulls the total motion back to zero.
    const Vector6 total = logarithm(compose(inverse(prior.pose), best));
    const Vector6 motion = (now.information + information).ldlt().solve(-now.gradient - information * total);
    if (!motion.allFinite()) break;
    best = compose(best, exponential(motion));
    best.rotation = best.rotation.normalized();
  }
  if (reduced != kTileEdge) reduce(predicted, kTileEdge, predicted_);
  warp.sample_tiles(best, observed_);
  out.error_after = relative_error(observed_, predicted_, texels_.tiles());
  out.aligned = out.error_after <= out.error_before;
  if (out.aligned) {
    out.probe_plane = best;
  } else {
    out.error_after = out.error_before;
  }
  warp.sample(out.probe_plane, image);
  return out;
}

}  // namespace lightwell::specular
