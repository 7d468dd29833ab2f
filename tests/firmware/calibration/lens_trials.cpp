#include "firmware/calibration/lens_trials.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/model/cameras.hpp"

namespace lightwell::shown {
namespace {

using namespace calibration;
using std::numbers::pi;
constexpr double kDegree = pi / 180;

void count_within(const LensFit& fit, const ModelParameters& truth, Trials& out) {
  const std::vector<double> found = parameters_of(fit.model), wanted = parameters_of(truth);
  out.within_3_sigma.resize(wanted.size());
  out.normalized.resize(wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    out.within_3_sigma[i] +=
        std::abs(found[i] - wanted[i]) <= 3 * std::sqrt(fit.covariance[i * wanted.size() + i]) ? 1 : 0;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    out.normalized[i] += std::pow(found[i] - wanted[i], 2) / fit.covariance[i * wanted.size() + i];
  out.focal.push_back(std::max(std::abs(found[0] / wanted[0] - 1), std::abs(found[1] / wanted[1] - 1)));
}

}  // namespace

LensParameters lens_of(LensKind kind) {
  LensParameters lens;
  lens.width = 1280;
  lens.height = 960;
  lens.max_angle_rad = 95 * kDegree;
  lens.pose_cv.rotation = upright_lens_cv();
  switch (kind) {
    case LensKind::kannala_brandt:
      lens.model = KannalaBrandtParameters{286, 285, 645, 473, -0.018, 0.0025, -0.0011, 1e-4};
      break;
    case LensKind::double_sphere:
      lens.model = DoubleSphereParameters{262, 261, 634, 488, -0.19, 0.59};
      break;
    case LensKind::mei:
      lens.model = MeiParameters{740, 738, 641, 478, 1.5, -0.05, 0.02, 2e-4, -3e-4};
      break;
  }
  return lens;
}

Pair back_to_back() {
  return {lens_of(LensKind::kannala_brandt),
          {Quat::about(normalized(Vec3d{0.02, 1, -0.01}), 179.2 * kDegree), {0.002, -0.001, -0.03}},
          0};
}

double direction_error(const LensParameters& truth, const ModelParameters& found) {
  LensParameters other = truth;
  other.model = found;
  other.max_angle_rad = pi;
  const CameraModel a(truth), b(other);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < truth.height; y += 8) {
    for (int x = 0; x < truth.width; x += 8) {
      const PixelPosition p{static_cast<double>(x), static_cast<double>(y)};
      const auto d = a.unproject(p), e = b.unproject(p);
      if (!d) continue;
      if (!e) return std::numeric_limits<double>::infinity();
      sum += std::pow(angle_between(*d, *e), 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

double observed_direction_error(const LensParameters& truth, const LensFit& found) {
  LensParameters other = truth;
  other.model = found.model;
  other.max_angle_rad = pi;
  const CameraModel a(truth), b(other);
  double sum = 0;
  int count = 0;
  for (int i = 1; i <= 12; ++i) {
    for (int j = 0; j < 8; ++j) {
      const double theta = found.max_observed_angle_rad * i / 12, phi = 2 * pi * j / 8;
      const Vec3d d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
      const auto pixel = a.project(d);
      if (!pixel) continue;
      const auto e = b.unproject(*pixel);
      if (!e) continue;
      sum += std::pow(angle_between(d, *e), 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

PairError pair_error(const Pose& truth, const Pose& found) {
  const Quat turn = found.rotation * truth.rotation.inverse();
  return {2 * std::asin(std::min(1.0, std::sqrt(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z))),
          length(found.translation - truth.translation)};
}

Trials lens_trials(LensKind kind, int count, const Show& show) {
  Trials out;
  const LensParameters truth = lens_of(kind);
  for (int seed = 1; seed <= count; ++seed) {
    Show each = show;
    each.seed = static_cast<std::uint32_t>(seed);
    ++out.count;
    const Result<GeometryFit> fit = calibrate_geometry(one_lens(truth, each), {.kind = kind});
    if (!fit) {
      ++out.failed;
      continue;
    }
    out.direction_rad.push_back(direction_error(truth, fit->lenses[0].model));
    count_within(fit->lenses[0], truth.model, out);
    const double deviation = fit->lenses[0].direction_uncertainty_rad / 3;
    out.normalized_direction += std::pow(observed_direction_error(truth, fit->lenses[0]) / deviation, 2);
    out.shaped += fit->boards[0].spacing_sigma > 0 ? 1 : 0;
  }
  const double done = out.count - out.failed;
  for (double& sum : out.normalized) sum = std::sqrt(sum / done);
  out.normalized_direction = std::sqrt(out.normalized_direction / done);
  return out;
}

Trials pair_trials(int count, const Show& show) {
  Trials out;
  const Pair truth = back_to_back();
  out.pair_within_3_sigma.assign(6, 0);
  for (int seed = 1; seed <= count; ++seed) {
    Show each = show;
    each.seed = static_cast<std::uint32_t>(seed);
    ++out.count;
    const Result<GeometryFit> fit = calibrate_geometry(pair_of_lenses(truth, each), {});
    if (!fit) {
      ++out.failed;
      continue;
    }
    for (const LensFit& lens : fit->lenses) {
      out.direction_rad.push_back(direction_error(truth.lens, lens.model));
      count_within(lens, truth.lens.model, out);
    }
    out.pair.push_back(pair_error(truth.lens1_from_lens0, fit->bundle.state.lens_from_rig[1]));
    // found = turn * truth, in lens 1's frame.
    Quat turn = fit->bundle.state.lens_from_rig[1].rotation * truth.lens1_from_lens0.rotation.inverse();
    if (turn.w < 0) turn = {-turn.x, -turn.y, -turn.z, -turn.w};
    const Vec3d shift = fit->bundle.state.lens_from_rig[1].translation - truth.lens1_from_lens0.translation;
    const double off[6] = {2 * turn.x, 2 * turn.y, 2 * turn.z, shift.x, shift.y, shift.z};
    for (std::size_t i = 0; i < 6; ++i)
      out.pair_within_3_sigma[i] += std::abs(off[i]) <= 3 * std::sqrt(fit->bundle.pair_covariance[7 * i]) ? 1 : 0;
  }
  return out;
}

}  // namespace lightwell::shown
