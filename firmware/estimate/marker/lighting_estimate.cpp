#include "estimate/marker/lighting_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>

#include <Eigen/Eigenvalues>

#include "estimate/marker/occluded_samples.hpp"
#include "estimate/marker/light_model_selector.hpp"
#include "estimate/marker/direction_uncertainty.hpp"
#include "estimate/marker/ground_reflection.hpp"

namespace lightwell::marker {
namespace {

/// Of the samples, at most so many may be something else; more, and the model is what is wrong.
constexpr double kMaxOutlierFraction = 0.35;
/// So many times are samples left out and the rest asked again.
constexpr int kRounds = 2;
/// The table is one plane of one colour where its samples differ from the model by no more than so many deviations,
/// RMS,
constexpr double kMaxGroundRms = 0.35;
/// without leaving out more than a few of them,
constexpr double kMinGroundInliers = 0.8;
/// and it shows a shadow where that explains so much more than none (a difference of chi squares).
constexpr double kMinShadowChiSquareGain = 30;

Shading reject_outliers(const Shading& shading, const Observations& seen, const Fit& fit, const LightingEstimateOptions& options,
                int& outliers) {
  Shading out = shading;
  out.samples.clear();
  const std::vector<double> of_faces = standardized_residuals(seen, fit.model);
  const auto most = static_cast<std::size_t>(kMaxOutlierFraction * static_cast<double>(of_faces.size()));
  std::vector<double> sorted;
  for (const double d : of_faces) sorted.push_back(std::abs(d));
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const double bound = std::max(options.outlier, sorted.empty() ? 0.0 : sorted[most]);
  for (std::size_t i = 0; i < of_faces.size(); ++i)
    if (std::abs(of_faces[i]) <= bound) out.samples.push_back(seen.of_faces()[i]);
  outliers = static_cast<int>(of_faces.size() - out.samples.size());
  if (shading.table && fit.table) {
    const std::vector<double> of_table = ground_residuals(seen, fit, shading.hull);
    out.table->samples.clear();
    for (std::size_t i = 0; i < of_table.size(); ++i)
      if (std::abs(of_table[i]) <= options.outlier) out.table->samples.push_back(shading.table->samples[i]);
  }
  return out;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

/// Whether the table's samples say where a lamp is: they fit a shadow, and without one they do not.
bool shadow_is_significant(const Observations& seen, const Fit& fit, const std::vector<Vec3d>& hull) {
  if (!fit.table || fit.model.lights.empty() || seen.table()->size() < 30) return false;
  const std::vector<double> with = ground_residuals(seen, fit, hull);
  if (rms(with) > kMaxGroundRms) return false;
  const Fit none = fit_lights(seen, {}, {}, ObservationSet::faces_and_ground_plane, hull, {});
  const std::vector<double> plain = ground_residuals(seen, none, hull);
  double gain = 0;
  for (std::size_t i = 0; i < with.size(); ++i) gain += plain[i] * plain[i] - with[i] * with[i];
  return gain > kMinShadowChiSquareGain;
}

/// In units in which the mean irradiance is one, and the table's mean radiance too: what a fit compares numbers with
/// has a size.
struct NormalizedShading {
  Shading shading;
  double irradiance = 0;  ///< One of those units.

  explicit NormalizedShading(const Shading& from) : shading(from) {
    double sum = 0, table = 0;
    for (const SurfaceSample& s : from.samples) sum += (s.irradiance[0] + s.irradiance[1] + s.irradiance[2]) / 3;
    if (!from.samples.empty()) irradiance = sum / static_cast<double>(from.samples.size());
    if (!(irradiance > 0) || !std::isfinite(irradiance)) {
      irradiance = 0;
      return;
    }
    for (SurfaceSample& s : shading.samples)
      for (std::size_t c = 0; c < 3; ++c)
        s.irradiance[c] /= irradiance, s.sigma[c] /= irradiance, s.from_ground[c] /= irradiance;
    if (!shading.table) return;
    for (const GroundSample& t : shading.table->samples)
      table += t.radiance / static_cast<double>(shading.table->samples.size());
    if (!(table > 0) || !std::isfinite(table)) {
      shading.table.reset();
      return;
    }
    for (GroundSample& t : shading.table->samples) t.radiance /= table, t.sigma /= table;
  }
};

/// What is told where what lies around the body is taken for that: the fit that BIC takes, without the samples that are
/// something else.
struct Hypothesis {  // `chooser` refers to `seen`, and to the hull of the shading that was asked about
  SurroundModel around = SurroundModel::distant;
  Shading inliers;
  std::unique_ptr<Observations> seen;
  std::unique_ptr<LightModelSelector> selector;
  FitCandidates candidates;
  int outliers = 0;
};

ObservationSet observations_for(SurroundModel around) { return around == SurroundModel::ground_plane_with_shadow ? ObservationSet::faces_and_ground_plane : ObservationSet::faces; }

/// `before`: its lamps are followed; nothing where they do not explain this frame. Null: lamps are looked for
/// everywhere.
std::optional<Hypothesis> evaluate(const Shading& shading, SurroundModel around, const LightingEstimateOptions& options,
                        const LightingEstimate* before) {
  Hypothesis out;
  out.around = around;
  out.inliers = shading;
  if (around != SurroundModel::distant) subtract_ground_reflection(out.inliers);
  if (around != SurroundModel::ground_plane_with_shadow) out.inliers.table.reset();
  out.outliers = remove_occluded_samples(out.inliers);
  for (int round = 0;; ++round) {
    out.seen = std::make_unique<Observations>(out.inliers, options.errors);
    out.selector = std::make_unique<LightModelSelector>(*out.seen, shading.hull, options, observations_for(around));
    if (before != nullptr) {
      std::optional<FitCandidates> followed = out.selector->follow(*before);
      if (!followed) return std::nullopt;
      out.candidates = std::move(*followed);
    } else {
      out.candidates = out.selector->seek();
    }
    if (round == (before != nullptr ? 1 : kRounds)) return out;
    int outliers = 0;
    Shading fewer = reject_outliers(out.inliers, *out.seen, out.candidates.best, options, outliers);
    const bool table_thinner =
        out.inliers.table && fewer.table && fewer.table->samples.size() < out.inliers.table->samples.size();
    if (outliers == 0 && !(round == 0 && table_thinner)) return out;
    out.outliers += outliers;
    out.inliers = std::move(fewer);
  }
}

/// Whether what lies around the body is a table with a shadow on it.
bool shadow_is_usable(const Shading& shading, const Hypothesis& both) {
  const auto inliers = static_cast<double>(both.inliers.table->samples.size()),
             all = static_cast<double>(shading.table->samples.size());
  return inliers >= kMinGroundInliers * all && shadow_is_significant(*both.seen, both.candidates.best, both.inliers.hull);
}

std::array<double, 3> numbers(const Eigen::Matrix2d& m) { return {m(0, 0), m(0, 1), m(1, 1)}; }

Eigen::Matrix2d matrix(const std::array<double, 3>& numbers) {
  Eigen::Matrix2d out;
  out << numbers[0], numbers[1], numbers[1], numbers[2];
  return out;
}

/// `before`: whose lamps were followed, in their order; null where they were looked for.
LightingEstimate finalize(Hypothesis hypothesis, const LightingEstimateOptions& options, const LightingEstimate* before) {
  const ObservationSet observation_set = observations_for(hypothesis.around);
  const bool shadow = hypothesis.around == SurroundModel::ground_plane_with_shadow;
  LightingEstimate out;
  const Fit& best = hypothesis.candidates.best;
  out.outliers = hypothesis.outliers;
  out.used = hypothesis.seen->samples();
  out.around = hypothesis.around;
  out.followed = before != nullptr;
  out.ambient = best.model.ambient;
  out.chi_square = best.chi_square / std::max(1, best.observations - best.parameters);
  out.searched = before != nullptr ? before->searched : out.chi_square;
  const double spread = model_misfit_variance(best.model);
  out.placed = !best.model.lights.empty() && (shadow || !(spread > 0));
  for (std::size_t k = 0; k < best.model.lights.size(); ++k) {
    LightEstimate lamp;
    lamp.lamp = best.model.lights[k];
    const Eigen::Matrix2d models = before != nullptr ? transport_covariance(matrix(before->lights[k].model_covariance),
                                                               before->lights[k].lamp.direction, lamp.lamp.direction)
                                                     : model_averaged_covariance(hypothesis.candidates, k);
    Eigen::Matrix2d covariance = multimodal_covariance(best, k, hypothesis.selector->search(), observation_set) + models;
    lamp.model_covariance = numbers(models);
    lamp.direction_covariance = numbers(covariance);
    const auto worst_of = [](const Eigen::Matrix2d& c) {
      return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(c).eigenvalues()[1]);
    };
    // Whatever another model would make of the faces: a shadow needs its lamp.
    out.placed = out.placed && (shadow || worst_of(covariance) <= options.max_direction_sigma_rad);
    if (!shadow) covariance += (source_size_variance(best, k, hypothesis.selector->search()) + spread) * Eigen::Matrix2d::Identity();
    const double worst = worst_of(covariance);
    lamp.unsure = !(worst <= options.max_direction_sigma_rad);
    if (lamp.unsure) lamp.direction_covariance = numbers(covariance);
    const double sigma = std::sqrt(best.covariance[k](2, 2));
    lamp.free = best.distances[k] == Distance::free;
    lamp.near = lamp.free && lamp.lamp.inverse_distance > 2 * sigma;
    lamp.inverse_distance_sigma = lamp.free ? sigma : std::numeric_limits<double>::infinity();
    out.lights.push_back(lamp);
  }
  std::sort(out.lights.begin(), out.lights.end(), [](const LightEstimate& a, const LightEstimate& b) {
    return luminance(a.lamp.irradiance) > luminance(b.lamp.irradiance);
  });
  out.unsure = out.lights.empty() || out.lights[0].unsure;
  out.inliers = std::move(hypothesis.inliers.samples);
  return out;
}

/// Who told before is asked first. Else what lies around the body is asked as a table with a shadow; as a table that
/// shows none, but sends its light to the faces; and, where that makes no lamp sure, as nothing of the kind.
LightingEstimate select_lighting(const Shading& shading, const LightingEstimateOptions& options, const LightingEstimate* before) {
  const bool table = shading.table && !shading.table->samples.empty();
  if (before != nullptr)
    if (std::optional<Hypothesis> hypothesis = evaluate(shading, table ? before->around : SurroundModel::distant, options, before))
      return finalize(std::move(*hypothesis), options, before);
  const auto search = [&](SurroundModel around) { return *evaluate(shading, around, options, nullptr); };
  if (table) {
    Hypothesis both = search(SurroundModel::ground_plane_with_shadow);
    if (shadow_is_usable(shading, both)) return finalize(std::move(both), options, nullptr);
    LightingEstimate out = finalize(search(SurroundModel::ground_plane), options, nullptr);
    if (!out.unsure) return out;
  }
  return finalize(search(SurroundModel::distant), options, nullptr);
}

}  // namespace

LightingEstimate estimate_lighting(const Shading& shading, const LightingEstimateOptions& options, const LightingEstimate* before) {
  NormalizedShading scaled(shading);
  LightingEstimate out;
  out.unsure = true;
  if (!(scaled.irradiance > 0)) return out;
  if (before != nullptr && before->lights.empty()) before = nullptr;
  out = select_lighting(scaled.shading, options, before);
  for (Rgb& coefficient : out.ambient)
    for (double& v : coefficient) v *= scaled.irradiance;
  for (LightEstimate& lamp : out.lights)
    for (double& v : lamp.lamp.irradiance) v *= scaled.irradiance;
  for (SurfaceSample& sample : out.inliers)
    for (std::size_t c = 0; c < 3; ++c) sample.irradiance[c] *= scaled.irradiance, sample.sigma[c] *= scaled.irradiance;
  return out;
}

}  // namespace lightwell::marker
