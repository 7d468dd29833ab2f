#include "calibration/solve/photometry/vignetting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Core>
#include <Eigen/QR>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr std::size_t kMinObservations = 8;
constexpr double kMinVignetting = 0.05;  // Lower limit in a calibration.

Status invalid(const std::string& what) { return invalid_argument("vignetting: " + what); }

std::string degrees(double rad) { return formatted("%.1f", rad * 180 / std::numbers::pi); }

Status check_sightings(std::span<const LampObservation> observations, double max_angle_rad) {
  if (!(max_angle_rad > 0 && max_angle_rad <= std::numbers::pi))
    return invalid("half the field of view must be above 0 and at most 180 deg");
  if (observations.size() < kMinObservations)
    return invalid(std::to_string(observations.size()) + " observations of the lamp, at least " +
                   std::to_string(kMinObservations) + " are needed; turn the camera in smaller steps");
  std::vector<double> angles;
  for (const LampObservation& s : observations) {
    if (!(s.angle_rad >= 0 && s.angle_rad <= 1.001 * max_angle_rad))
      return invalid("an angle of " + degrees(s.angle_rad) + " deg lies outside the field of " +
                     degrees(max_angle_rad) + " deg to either side");
    if (!(s.value > 0) || !std::isfinite(s.value) || !(s.deviation >= 0) || !std::isfinite(s.deviation))
      return invalid("the lamp's value at " + degrees(s.angle_rad) + " deg is not positive; remove that picture");
    angles.push_back(s.angle_rad);
  }
  std::sort(angles.begin(), angles.end());
  const std::string asked = "rotate the camera so that the lamp moves from the middle of the picture to its edge";
  if (angles.front() > 0.25 * max_angle_rad)
    return invalid("no observation is nearer to the axis than " + degrees(angles.front()) + " deg; " + asked);
  if (angles.back() < 0.9 * max_angle_rad)
    return invalid("no observation is further from the axis than " + degrees(angles.back()) + " deg of " +
                   degrees(max_angle_rad) + "; " + asked + ", or lower max_angle_deg");
  for (std::size_t i = 1; i < angles.size(); ++i)
    if (angles[i] - angles[i - 1] > max_angle_rad / 3)
      return invalid("nothing between " + degrees(angles[i - 1]) + " and " + degrees(angles[i]) +
                     " deg; turn the camera in smaller steps");
  return {};
}

Eigen::RowVector4d powers(double share) {
  const double t = share * share;
  return {1, t, t * t, t * t * t};
}

/// The lamp's pixels are those above this fraction of its peak, and a margin around them for the blur of the lens.
constexpr double kMinShareOfPeak = 0.1;
constexpr double kRim = 3;

/// Linear value and solid angle by site.
struct Sites {
  int width = 0, height = 0;
  std::vector<double> light, solid_angle;
  std::vector<bool> saturated;

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Box filter of 3 x 3 sites, so that a single noisy site is not taken for a lamp.
std::vector<double> smoothed(const Sites& s) {
  std::vector<double> out(s.light.size());
  for (int y = 1; y + 1 < s.height; ++y)
    for (int x = 1; x + 1 < s.width; ++x) {
      double sum = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) sum += s.light[s.index(x + i, y + j)] / 9;
      out[s.index(x, y)] = s.solid_angle[s.index(x, y)] > 0 ? sum : 0;
    }
  return out;
}

struct Blob {
  double x = 0, y = 0, radius = 0;
};

/// The connected region around `peak` of sites with light of at least `least`.
Blob connected_region(const Sites& s, const std::vector<double>& light, std::size_t peak, double least) {
  std::vector<std::size_t> found{peak};
  std::vector<bool> seen(light.size());
  seen[peak] = true;
  const auto width = static_cast<std::size_t>(s.width);
  double total = 0;
  Blob out;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const std::size_t at = found[k], x = at % width, y = at / width;
    total += s.light[at];
    out.x += s.light[at] * static_cast<double>(x);
    out.y += s.light[at] * static_cast<double>(y);
    const std::size_t next[] = {x > 0 ? at - 1 : at, x + 1 < width ? at + 1 : at, y > 0 ? at - width : at,
                                y + 1 < static_cast<std::size_t>(s.height) ? at + width : at};
    for (const std::size_t n : next) {
      if (seen[n] || light[n] < least) continue;
      seen[n] = true;
      found.push_back(n);
    }
  }
  out.x /= total;
  out.y /= total;
  for (const std::size_t at : found)
    out.radius = std::max(out.radius,
                          std::hypot(static_cast<double>(at % width) - out.x, static_cast<double>(at / width) - out.y));
  return out;
}

}  // namespace

Result<LampFinder> LampFinder::make(const LensParameters& lens) {
  RigParameters rig;  // Only this lens, so that its solid angles are not weighted for an overlap.
  rig.lenses = {lens};
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  LampFinder out;
  out.lens_ = lens;
  out.solid_angle_ = std::move(table->lenses.front().solid_angle);
  return out;
}

Result<LampObservation> LampFinder::find(const Picture& picture, double exposure, std::optional<double> angle_rad,
                                         const std::string& name) const {
  const auto refused = [&](const std::string& what) { return invalid_argument(name + ": " + what); };
  const int pitch = picture.pitch;
  if (picture.width * pitch != lens_.width || picture.height * pitch != lens_.height)
    return refused(formatted("it has %dx%d pixels, the calibration speaks of %dx%d", picture.width * pitch,
                             picture.height * pitch, lens_.width, lens_.height));
  if (!(exposure > 0) || !std::isfinite(exposure)) return refused("its exposure must be positive");
  const PhotometricCalibration& p = lens_.photometry;
  Sites sites{picture.width, picture.height, {}, {}, {}};
  std::vector<double> of_field;
  for (int y = 0; y < sites.height; ++y)
    for (int x = 0; x < sites.width; ++x) {
      double sum = 0, solid_angle = 0;
      bool saturated = false;
      for (int c = 0; c < 3; ++c) {
        const double v = static_cast<double>(picture.at(x, y, c));
        sum += linear_value(p, v);
        saturated = saturated || v >= p.saturation;
      }
      for (int k = 0; k < pitch * pitch; ++k)
        solid_angle += static_cast<double>(
            solid_angle_[static_cast<std::size_t>(y * pitch + k / pitch) * static_cast<std::size_t>(lens_.width) +
                         static_cast<std::size_t>(x * pitch + k % pitch)]);
      sites.light.push_back(sum);
      sites.solid_angle.push_back(solid_angle);
      sites.saturated.push_back(saturated);
      if (solid_angle > 0) of_field.push_back(sum);
    }
  const double around = median(of_field);
  std::vector<double> off = of_field;
  for (double& v : off) v -= around;
  const double noise = std::max(scale_about_zero(off), 3 * rounding_deviation(picture.levels));
  const std::vector<double> light = smoothed(sites);
  const auto peak = static_cast<std::size_t>(std::max_element(light.begin(), light.end()) - light.begin());
  if (!(light[peak] > around + 20 * noise && light[peak] > 0.05))
    return refused("no lamp stands out; darken the room, or use a longer exposure");

  const Blob blob = connected_region(sites, light, peak, around + kMinShareOfPeak * (light[peak] - around));
  const double inner = blob.radius + kRim / pitch, outer = 1.5 * inner + kRim;
  const int across = std::min(sites.width, sites.height);
  if (2 * blob.radius > across / 10.0)
    return refused("the lamp is " + std::to_string(static_cast<int>(2 * blob.radius)) +
                   " pixels wide; take a smaller one or go further away, to less than a tenth of the picture");
  std::vector<double> ring;
  double sum = 0, area = 0, variance = 0;
  std::vector<std::pair<double, double>> inside;  // light, solid angle
  for (int y = static_cast<int>(std::floor(blob.y - outer)); y <= static_cast<int>(std::ceil(blob.y + outer)); ++y)
    for (int x = static_cast<int>(std::floor(blob.x - outer)); x <= static_cast<int>(std::ceil(blob.x + outer)); ++x) {
      const double distance = std::hypot(x - blob.x, y - blob.y);
      if (distance > outer) continue;
      const bool there =
          x >= 0 && y >= 0 && x < sites.width && y < sites.height && sites.solid_angle[sites.index(x, y)] > 0;
      if (!there && distance <= inner)
        return refused("the lamp is cut by the edge of the picture or of the field of view; remove this picture");
      if (!there) continue;
      const std::size_t k = sites.index(x, y);
      if (distance > inner) {
        ring.push_back(sites.light[k]);
        continue;
      }
      if (sites.saturated[k]) return refused("the lamp is saturated; take all pictures with a shorter exposure");
      sum += sites.light[k] * sites.solid_angle[k];
      area += sites.solid_angle[k];
      variance += sites.solid_angle[k] * sites.solid_angle[k] *
                  (3 * p.read_noise * p.read_noise + p.shot_noise * std::max(0.0, sites.light[k]));
    }
  const double background = ring.empty() ? 0 : median(ring);
  LampObservation out;
  out.value = (sum - background * area) / exposure;
  out.deviation = std::sqrt(variance) / exposure;
  if (!(out.value > 0)) return refused("no light is left of the lamp above its surroundings; darken the room");
  if (angle_rad) {
    out.angle_rad = *angle_rad;
    return out;
  }
  const auto direction =
      CameraModel(lens_).unproject({pitch * blob.x + (pitch - 1) / 2.0, pitch * blob.y + (pitch - 1) / 2.0});
  if (!direction) return refused("the lamp is outside the field of view; remove this picture");
  out.angle_rad = std::atan2(std::hypot(direction->x, direction->y), direction->z);
  return out;
}

Result<VignettingEstimate> solve_vignetting(std::span<const LampObservation> observations, double max_angle_rad) {
  if (const Status s = check_sightings(observations, max_angle_rad); !s.ok()) return s;
  const auto n = static_cast<Eigen::Index>(observations.size());
  // Normalise angles by the field and values by their median, so that the columns have similar magnitude.
  std::vector<double> values;
  for (const LampObservation& s : observations) values.push_back(s.value);
  const double unit = median(values);
  const bool all_known =
      std::all_of(observations.begin(), observations.end(), [](const auto& s) { return s.deviation > 0; });
  Eigen::MatrixXd rows(n, 4);
  Eigen::VectorXd right(n), deviation(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const LampObservation& s = observations[static_cast<std::size_t>(k)];
    rows.row(k) = powers(s.angle_rad / max_angle_rad);
    right(k) = s.value / unit;
    deviation(k) = (all_known ? s.deviation : s.value) / unit;
  }

  Eigen::Vector4d found = Eigen::Vector4d::Zero();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
  std::vector<double> scaled(observations.size());
  double scale = 1;
  for (int pass = 0; pass < 60; ++pass) {
    const Eigen::VectorXd root = weight.cwiseSqrt().cwiseQuotient(deviation);
    const Eigen::Vector4d before = found;
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(root.asDiagonal() * rows);
    if (solver.rank() < 4) return invalid("too few different angles; turn the camera in more and even steps");
    found = solver.solve(root.cwiseProduct(right));
    for (Eigen::Index k = 0; k < n; ++k)
      scaled[static_cast<std::size_t>(k)] = (right(k) - rows.row(k).dot(found)) / deviation(k);
    // Corrected for four estimated parameters; limited from below, because exact data have a scale of 0.
    scale = std::max(1e-9, scale_about_zero(scaled) *
                               std::sqrt(static_cast<double>(n) / std::max<double>(1, static_cast<double>(n - 4))));
    if (all_known) scale = std::max(scale, 1.0);
    for (Eigen::Index k = 0; k < n; ++k) {
      // First a smoothed L1 loss, which has a unique minimum, then Tukey's biweight, which rejects outliers.
      const double u = scaled[static_cast<std::size_t>(k)] / scale;
      weight(k) = pass < 10 ? 1 / std::max(1.0, std::abs(u)) : tukey_weight(u);
      // Unknown standard deviations are proportional to the curve; the observation's error would affect its weight.
      if (!all_known) deviation(k) = std::max(rows.row(k).dot(found), 1e-3);
    }
    if (pass > 12 && (found - before).cwiseAbs().maxCoeff() < 1e-13 * found.cwiseAbs().maxCoeff()) break;
  }
  if (!(found(0) > 0)) return invalid("the estimated light on the axis is not positive; check the list of angles");

  VignettingEstimate out;
  double slope = 0, squares = 0;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  std::vector<double> shares;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double u = scaled[static_cast<std::size_t>(k)] / scale, w = tukey_weight(u);
    slope += tukey_slope(u) / static_cast<double>(n);
    squares += w * w * u * u;
    normal += rows.row(k).transpose() * rows.row(k) / (deviation(k) * deviation(k));
    out.weight.push_back(w);
    out.outliers += w > 0 ? 0 : 1;
    shares.push_back(scaled[static_cast<std::size_t>(k)] * deviation(k) / std::max(rows.row(k).dot(found), 1e-3));
  }
  // Variance of an M-estimator: Huber 1981, eq. 7.6.6.
  const double variance = scale * scale * squares / static_cast<double>(n - 4) / (slope * slope);
  const Eigen::Matrix4d covariance = variance * normal.completeOrthogonalDecomposition().pseudoInverse();
  out.residual = scale_about_zero(shares);
  out.level = found(0) * unit;
  Eigen::Matrix<double, 3, 4> jacobian = Eigen::Matrix<double, 3, 4>::Zero();
  for (int i = 0; i < 3; ++i) {
    const double angle = std::pow(max_angle_rad, -2.0 * (i + 1));
    out.vignetting[static_cast<std::size_t>(i)] = found(i + 1) / found(0) * angle;
    jacobian(i, 0) = -found(i + 1) / (found(0) * found(0)) * angle;
    jacobian(i, i + 1) = angle / found(0);
  }
  const Eigen::Matrix3d of_curve = jacobian * covariance * jacobian.transpose();
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out.covariance.data()) = of_curve;

  for (int i = 0; i <= 128; ++i) {
    const double left = powers(i / 128.0).dot(found) / found(0);
    if (!(left >= kMinVignetting))
      return invalid("the relative illumination is " + std::to_string(left) + " at " +
                     degrees(max_angle_rad * i / 128.0) +
                     " deg, at least 0.05 is needed; lower max_angle_deg to where the lens still sees");
  }
  return out;
}

double vignetting_deviation(const VignettingEstimate& estimate, double angle_rad) {
  const double t = angle_rad * angle_rad;
  const std::array<double, 3> by{t, t * t, t * t * t};
  double variance = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) variance += by[i] * estimate.covariance[3 * i + k] * by[k];
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace lightwell::photometry
