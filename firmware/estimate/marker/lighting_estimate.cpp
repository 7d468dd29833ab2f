#include "estimate/marker/lighting_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>

#include <Eigen/LU>
#include <Eigen/QR>

#include "estimate/marker/direction_spread.hpp"
#include "estimate/marker/ground_light.hpp"
#include "estimate/marker/light_model_selector.hpp"

namespace lightwell::marker {
namespace {

/// Residual, in standard deviations, above which a sample is an outlier (another object or its shadow).
constexpr double kOutlierThreshold = 4.5;
/// Largest share of samples rejected as outliers; more would mean that the model is wrong.
constexpr double kMaxOutlierFraction = 0.35;
/// Number of times that outliers are rejected and the fit is repeated.
constexpr int kMaxOutlierRounds = 2;
/// The shadow is used where at least this share of the ground samples are inliers,
constexpr double kMinGroundInliers = 0.8;
/// and it reduces the deviance that a smooth brightness leaves by more than this: three standard deviations.
constexpr double kMinShadowDevianceGain = 9;

/// Smallest sine of the elevation of a light whose shadow is used: 5 degrees. Below it, a shadow has no end.
constexpr double kMinShadowElevation = 0.087;

/// Standard deviation of a texture below which it is negligible beside kShadowModelSigma.
constexpr double kMinTextureSigma = 0.03;

/// Twice the logarithm of the prior odds that a plane below the body is a table: 9 to 1.
constexpr double kGroundPlanePrior = 4.4;

/// Smallest change of the logarithm of the faces' variances for which a search is repeated.
constexpr double kMinReweighting = 0.4;

/// Radii of discs tried in place of a point light, and the chi square increase up to which one explains the faces.
constexpr std::array kSourceRadii_rad = {0.2, 0.4, 0.7, 1.0};
constexpr double kMaxChiSquareIncrease = 16;
/// Largest standard deviation of the direction by the unknown size of the source: 8.6 degrees.
constexpr double kMaxSourceSigma_rad = 0.15;
/// Largest standard deviation of the direction with the other modes: 11.5 degrees.
constexpr double kMaxTotalSigma_rad = 0.2;
/// Probability of other modes above which a light is uncertain.
constexpr double kMaxElsewhere = 0.05;
/// Irradiance of a light that the ambient light may hide, relative to the strongest light that was found, above which
/// the answer is uncertain. A room has such a gradient, too: 1.5 is exceeded by a twentieth of the right answers of
/// the scenes `dev`.
constexpr double kMaxHiddenLight = 1.5;
/// Standard deviation of a direction where point lights do not explain the observations.
constexpr double kModelMisfit_rad = 0.2;

/// Converts a covariance from tangent_basis(from) to tangent_basis(to); exact in the limit of a small rotation.
Eigen::Matrix2d transport_covariance(const Eigen::Matrix2d& covariance, Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const auto [s, t] = tangent_basis(to);
  Eigen::Matrix2d rotation;
  rotation << dot(s, u), dot(s, v), dot(t, u), dot(t, v);
  return rotation * covariance * rotation.transpose();
}

/// Variance of the direction along each axis, rad², due to the unknown size of the light: that of the widest disc that
/// explains the faces as well. A diffuse surface hardly distinguishes a wide light from a point in its middle, and the
/// brightest part may be anywhere in it. (The sharpness of a shadow's edge limits the size; this function ignores it.)
double source_size_variance(const Fit& best, std::size_t which, const LightSearch& search) {
  std::vector<PointLight> fixed_lights = best.model.lights;
  fixed_lights.erase(fixed_lights.begin() + static_cast<std::ptrdiff_t>(which));
  const PointLight& light = best.model.lights[which];
  const double as_point = search.chi_square_of(light, 0, fixed_lights);
  double widest = 0;
  for (const double radius : kSourceRadii_rad)
    if (search.chi_square_of(light, radius, fixed_lights) < as_point + kMaxChiSquareIncrease) widest = radius;
  return widest * widest / 4;
}

/// Variance of the direction along each axis, rad², where the fitted ambient irradiance is negative at some normal.
double model_misfit_variance(const LightModel& model) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double slope = std::hypot(model.ambient[1][c], model.ambient[2][c], model.ambient[3][c]);
    if (slope > model.ambient[0][c]) return kModelMisfit_rad * kModelMisfit_rad;
  }
  return 0;
}

/// Whether the ambient light may hide a light that is stronger than `light`: a lamp of irradiance E that is fitted as
/// ambient light has linear coefficients of length E / 2 (the projection of max(0, cos) onto them; Ramamoorthi &
/// Hanrahan 2001, eq. 8: cosine_lobe(1) * 3 / (4 pi)).
bool may_hide_light(const std::array<Rgb, 4>& ambient, const PointLight& light) {
  return 2 * std::hypot(luminance(ambient[1]), luminance(ambient[2]), luminance(ambient[3])) >
         kMaxHiddenLight * luminance(light.irradiance);
}

/// The shading without outliers; `outliers` is set to the number of rejected face samples. `known_texture`: of the
/// ground; nullopt: it is fitted to the residuals (15 whitenings).
Shading reject_outliers(const Shading& shading, const Observations& observations, const Fit& fit,
                        const std::optional<GroundTexture>& known_texture, int& outliers) {
  Shading out = shading;
  out.samples.clear();
  const std::vector<double> face_residuals = standardized_residuals(observations, fit.model);
  const auto most = static_cast<std::size_t>(kMaxOutlierFraction * static_cast<double>(face_residuals.size()));
  std::vector<double> sorted;
  for (const double d : face_residuals) sorted.push_back(std::abs(d));
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const double bound = std::max(kOutlierThreshold, sorted.empty() ? 0.0 : sorted[most]);
  for (std::size_t i = 0; i < face_residuals.size(); ++i)
    if (std::abs(face_residuals[i]) <= bound) out.samples.push_back(observations.face_samples()[i]);
  outliers = static_cast<int>(face_residuals.size() - out.samples.size());
  if (shading.ground && fit.ground) {
    const GroundObservations& ground = *observations.ground();
    Eigen::ArrayXd residuals = ground_residuals(observations, fit, shading.hull);
    const GroundTexture texture = known_texture ? *known_texture : ground.fit_texture(residuals);
    residuals -= ground.smooth_part(residuals, texture);
    out.ground->samples.clear();
    for (Eigen::Index i = 0; i < residuals.size(); ++i)
      if (std::abs(residuals[i]) <=
          kOutlierThreshold * ground.mean_radiance * std::hypot(texture.sigma, std::sqrt(ground.own_variance[i])))
        out.ground->samples.push_back(shading.ground->samples[static_cast<std::size_t>(i)]);
  }
  return out;
}

/// Whether the ground samples determine a light: its shadow explains what ambient light that the body occludes and a
/// smooth brightness (a quadratic in the plane's coordinates: falloff of near lights, sheen) leave, each fitted by
/// least squares, with the texture that fits best. The lights of the fit are one term, in its proportions.
bool shadow_is_significant(const Observations& observations, const Fit& fit, const std::vector<Vec3d>& hull) {
  if (!fit.ground || fit.model.lights.empty() || observations.ground()->size() < 30) return false;
  const GroundObservations& ground = *observations.ground();
  if (dot(fit.model.lights[strongest(fit.model)].direction, ground.normal) < kMinShadowElevation) return false;
  const Eigen::ArrayXd by_lights =
      ground.radiance - fit.ground_ambient * ground.open - ground_residuals(observations, fit, hull);
  Eigen::MatrixXd terms(ground.size(), 8);
  terms << ground.open.matrix(), Eigen::VectorXd::Ones(ground.size()), ground.neighbours.smooth_terms(),
      by_lights.matrix();
  const Eigen::VectorXd radiance = ground.radiance.matrix();
  const auto deviance_with = [&](Eigen::Index count) {
    const auto used = terms.leftCols(count);
    const Eigen::ArrayXd residuals = (radiance - used * used.colPivHouseholderQr().solve(radiance)).array();
    return ground.deviance(residuals, ground.fit_texture(residuals));
  };
  return deviance_with(7) - deviance_with(8) > kMinShadowDevianceGain;
}

/// Shading with a mean irradiance of the faces and a mean ground radiance of 1: the fit's tolerances are absolute.
struct NormalizedShading {
  Shading shading;
  double irradiance = 0;  ///< The unit: the mean irradiance; 0 where it is not positive and finite.

  explicit NormalizedShading(const Shading& from) : shading(from) {
    double sum = 0, ground_radiance = 0;
    for (const SurfaceSample& s : from.samples) sum += (s.irradiance[0] + s.irradiance[1] + s.irradiance[2]) / 3;
    if (!from.samples.empty()) irradiance = sum / static_cast<double>(from.samples.size());
    if (!(irradiance > 0) || !std::isfinite(irradiance)) {
      irradiance = 0;
      return;
    }
    for (SurfaceSample& s : shading.samples)
      for (std::size_t c = 0; c < 3; ++c)
        s.irradiance[c] /= irradiance, s.sigma[c] /= irradiance, s.from_ground[c] /= irradiance;
    if (!shading.ground) return;
    for (const GroundSample& t : shading.ground->samples)
      ground_radiance += t.radiance / static_cast<double>(shading.ground->samples.size());
    if (!(ground_radiance > 0) || !std::isfinite(ground_radiance)) {
      shading.ground.reset();
      return;
    }
    for (GroundSample& t : shading.ground->samples) t.radiance /= ground_radiance, t.sigma /= ground_radiance;
  }
};

/// Best fit under one assumption about the surroundings, after outlier rejection.
/// `selector` refers to `observations`, and to the hull of the shading given to evaluate().
struct Hypothesis {
  SurroundModel surround_model = SurroundModel::distant;
  Shading inliers;
  std::unique_ptr<Observations> observations;
  std::unique_ptr<LightModelSelector> selector;
  FitCandidates candidates;
  std::optional<GroundTexture> texture;
  double face_dispersion = 1;
  int outliers = 0;
};

ObservationSet observations_for(SurroundModel surround_model) {
  return surround_model == SurroundModel::ground_plane_with_shadow ? ObservationSet::faces_and_ground_plane
                                                                   : ObservationSet::faces;
}

/// `previous`: the estimate whose lights are tracked; nullopt where they do not explain this frame. Null: search.
std::optional<Hypothesis> evaluate(const Shading& shading, SurroundModel surround_model,
                                   const LightingEstimate* previous, int max_lights) {
  Hypothesis out;
  out.surround_model = surround_model;
  out.inliers = shading;
  if (surround_model != SurroundModel::distant) subtract_ground_reflection(out.inliers);
  if (surround_model != SurroundModel::ground_plane_with_shadow) out.inliers.ground.reset();
  out.outliers = remove_occluded_samples(out.inliers);
  if (previous != nullptr) out.texture = previous->ground_texture, out.face_dispersion = previous->face_dispersion;
  for (int round = 0;; ++round) {
    out.observations = std::make_unique<Observations>(out.inliers, out.texture, out.face_dispersion);
    out.selector =
        std::make_unique<LightModelSelector>(*out.observations, shading.hull, observations_for(surround_model));
    if (previous != nullptr) {
      std::optional<FitCandidates> tracked = out.selector->track(*previous);
      if (!tracked) return std::nullopt;
      out.candidates = std::move(*tracked);
    } else {
      out.candidates = out.selector->search(max_lights);
    }
    if (round == (previous != nullptr ? 1 : kMaxOutlierRounds)) return out;
    // A texture weakens the observations of the shadow: the search is repeated with it.
    bool textured = false, reweighted = false;
    double face_dispersion = out.face_dispersion;
    if (previous == nullptr && out.observations->ground() != nullptr) {
      const GroundObservations& ground = *out.observations->ground();
      out.texture = ground.fit_texture(ground_residuals(*out.observations, out.candidates.best, shading.hull));
      textured = out.texture->sigma > kMinTextureSigma || ground.texture.sigma > kMinTextureSigma;
      // Errors of the faces that the model does not know (gloss, folds) weaken them beside the shadow.
      face_dispersion = std::max(1.0, out.face_dispersion * out.candidates.best.face_dispersion());
      reweighted = std::abs(std::log(face_dispersion / out.face_dispersion)) > kMinReweighting;
    }
    int outliers = 0;
    // After a search, its residuals are the first from which the texture is known.
    const std::optional<GroundTexture> known_texture = previous != nullptr ? previous->ground_texture : std::nullopt;
    Shading fewer = reject_outliers(out.inliers, *out.observations, out.candidates.best, known_texture, outliers);
    const bool ground_thinned =
        out.inliers.ground && fewer.ground && fewer.ground->samples.size() < out.inliers.ground->samples.size();
    if (outliers == 0 && !reweighted && !(round == 0 && (textured || ground_thinned))) return out;
    out.face_dispersion = face_dispersion;
    out.outliers += outliers;
    out.inliers = std::move(fewer);
  }
}

/// Whether the surroundings are a ground plane with a shadow: enough ground inliers, and a significant shadow.
bool shadow_is_usable(const Shading& shading, const Hypothesis& hypothesis) {
  const auto inliers = static_cast<double>(hypothesis.inliers.ground->samples.size()),
             all = static_cast<double>(shading.ground->samples.size());
  return inliers >= kMinGroundInliers * all &&
         shadow_is_significant(*hypothesis.observations, hypothesis.candidates.best, hypothesis.inliers.hull);
}

std::array<double, 3> numbers(const Eigen::Matrix2d& m) { return {m(0, 0), m(0, 1), m(1, 1)}; }

Eigen::Matrix2d matrix(const std::array<double, 3>& numbers) {
  Eigen::Matrix2d out;
  out << numbers[0], numbers[1], numbers[1], numbers[2];
  return out;
}

/// Covariance of the direction of light `which` of a search, and whether it is uncertain. `misfit`:
/// model_misfit_variance() of the best fit. Clears `localized` where the faces alone do not determine the direction.
void estimate_spread(const Hypothesis& hypothesis, std::size_t which, double misfit, LightEstimate& out,
                     bool& localized) {
  const bool shadow = hypothesis.surround_model == SurroundModel::ground_plane_with_shadow;
  const Fit& best = hypothesis.candidates.best;
  LightSearch& search = hypothesis.selector->light_search();
  const DirectionSpread models = model_spread(hypothesis.candidates, which),
                        modes = multimodal_spread(best, which, search, observations_for(hypothesis.surround_model));
  const Eigen::Matrix2d covariance = modes.covariance + models.covariance;
  const double elsewhere = 1 - (1 - modes.elsewhere) * (1 - models.elsewhere);
  // A shadow determines the light, even if other models of the faces are possible.
  localized = localized && (shadow || worst_sigma(numbers(covariance)) <= kMaxDirectionSigma_rad);
  const double size = shadow ? 0 : misfit + source_size_variance(best, which, search);
  out.uncertain = !(worst_sigma(numbers(modes.main_mode + models.main_mode)) <= kMaxDirectionSigma_rad) ||
                  !(worst_sigma(numbers(covariance)) <= kMaxTotalSigma_rad) ||
                  !(std::sqrt(size) <= kMaxSourceSigma_rad) || !(elsewhere <= kMaxElsewhere);
  out.direction_covariance = numbers(covariance + (out.uncertain ? size : 0) * Eigen::Matrix2d::Identity());
  out.fit_variance = best.covariance[which].topLeftCorner<2, 2>().trace();
}

/// The same for a light that was tracked: as at the last search, `before`, and wider where the fit has become so.
void keep_spread(const LightEstimate& before, const Fit& fit, std::size_t which, LightEstimate& out) {
  const double now = fit.covariance[which].topLeftCorner<2, 2>().trace();
  const double wider = before.fit_variance > 0 ? std::max(1.0, now / before.fit_variance) : 1;
  const Eigen::Matrix2d covariance =
      wider * transport_covariance(matrix(before.direction_covariance), before.light.direction, out.light.direction);
  out.direction_covariance = numbers(covariance);
  out.fit_variance = wider * before.fit_variance;
  out.uncertain = before.uncertain || !(worst_sigma(numbers(covariance)) <= kMaxTotalSigma_rad);
}

/// The best fit as an estimate with uncertainties. `previous`: with the tracked lights in the same order, or null.
LightingEstimate finalize(Hypothesis hypothesis, const LightingEstimate* previous) {
  const bool shadow = hypothesis.surround_model == SurroundModel::ground_plane_with_shadow;
  LightingEstimate out;
  const Fit& best = hypothesis.candidates.best;
  out.outliers = hypothesis.outliers;
  out.used = hypothesis.observations->samples();
  out.surround_model = hypothesis.surround_model;
  out.tracked = previous != nullptr;
  out.ground_texture = hypothesis.texture;
  out.face_dispersion = hypothesis.face_dispersion;
  out.ambient = best.model.ambient;
  out.chi_square = best.chi_square / std::max(1, best.observations - best.parameters);
  out.chi_square_at_search = previous != nullptr ? previous->chi_square_at_search : out.chi_square;
  const double misfit = model_misfit_variance(best.model);
  out.localized = previous != nullptr ? previous->localized : !best.model.lights.empty() && (shadow || !(misfit > 0));
  for (std::size_t k = 0; k < best.model.lights.size(); ++k) {
    LightEstimate light_estimate;
    light_estimate.light = best.model.lights[k];
    if (previous != nullptr)
      keep_spread(previous->lights[k], best, k, light_estimate);
    else
      estimate_spread(hypothesis, k, misfit, light_estimate, out.localized);
    const double sigma = std::sqrt(best.covariance[k](2, 2));
    light_estimate.distance_estimated = best.distances[k] == Distance::free;
    light_estimate.distance_observable =
        light_estimate.distance_estimated && light_estimate.light.inverse_distance > 2 * sigma;
    light_estimate.inverse_distance_sigma =
        light_estimate.distance_estimated ? sigma : std::numeric_limits<double>::infinity();
    out.lights.push_back(light_estimate);
  }
  std::sort(out.lights.begin(), out.lights.end(), [](const LightEstimate& a, const LightEstimate& b) {
    return luminance(a.light.irradiance) > luminance(b.light.irradiance);
  });
  out.uncertain = out.lights.empty() || out.lights[0].uncertain || may_hide_light(out.ambient, out.lights[0].light);
  out.inliers = std::move(hypothesis.inliers.samples);
  return out;
}

/// Tries the previous frame's hypothesis first. Otherwise tries a ground plane with a shadow. Without a shadow, a plane
/// that only reflects light onto the faces and distant surroundings are compared, and both count in the covariance.
LightingEstimate select_lighting(const Shading& shading, const LightingEstimate* previous, int max_lights) {
  const bool has_ground = shading.ground && !shading.ground->samples.empty();
  if (previous != nullptr)
    if (std::optional<Hypothesis> hypothesis =
            evaluate(shading, has_ground ? previous->surround_model : SurroundModel::distant, previous, max_lights))
      return finalize(std::move(*hypothesis), previous);
  const auto search = [&](SurroundModel surround_model) {
    return *evaluate(shading, surround_model, nullptr, max_lights);
  };
  if (has_ground) {
    Hypothesis with_shadow = search(SurroundModel::ground_plane_with_shadow);
    if (shadow_is_usable(shading, with_shadow)) return finalize(std::move(with_shadow), nullptr);
  }
  Hypothesis distant = search(SurroundModel::distant);
  if (!has_ground) return finalize(std::move(distant), nullptr);
  Hypothesis plane = search(SurroundModel::ground_plane);
  // Both explain the same samples of the faces, so that their BIC can be compared.
  const bool plane_is_likelier = plane.candidates.best.bic() < distant.candidates.best.bic() + kGroundPlanePrior;
  Hypothesis& likelier = plane_is_likelier ? plane : distant;
  const Hypothesis& other = plane_is_likelier ? distant : plane;
  likelier.candidates.others.push_back(other.candidates.best);
  return finalize(std::move(likelier), nullptr);
}

}  // namespace

double worst_sigma(const std::array<double, 3>& covariance) {
  const auto [uu, uv, vv] = covariance;
  return std::sqrt((uu + vv) / 2 + std::hypot((uu - vv) / 2, uv));
}

LightingEstimate estimate_lighting(const Shading& shading, const LightingEstimate* previous, int max_lights) {
  NormalizedShading input(shading);
  LightingEstimate out;
  out.uncertain = true;
  if (!(input.irradiance > 0)) return out;
  if (previous != nullptr && previous->lights.empty()) previous = nullptr;
  out = select_lighting(input.shading, previous, max_lights);
  for (Rgb& coefficient : out.ambient)
    for (double& v : coefficient) v *= input.irradiance;
  for (LightEstimate& light_estimate : out.lights)
    for (double& v : light_estimate.light.irradiance) v *= input.irradiance;
  for (SurfaceSample& sample : out.inliers)
    for (std::size_t c = 0; c < 3; ++c) sample.irradiance[c] *= input.irradiance, sample.sigma[c] *= input.irradiance;
  if (out.surround_model != SurroundModel::distant) {
    std::vector<PointLight> lights;
    for (const LightEstimate& light_estimate : out.lights) lights.push_back(light_estimate.light);
    out.ground = unoccluded_ground_irradiance(shading, lights);
  }
  return out;
}

}  // namespace lightwell::marker
