#include "estimate/marker/light_model_selector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace lightwell::marker {
namespace {

/// Largest reduced chi square of tracking relative to that of the last search, or to kAcceptableChiSquare if larger.
constexpr double kMaxTrackingChiSquareRatio = 1.5;
constexpr double kAcceptableChiSquare = 0.3;
/// Iterations of a tracking fit, which starts near the minimum.
constexpr int kMaxTrackingIterations = 6;
/// Smallest irradiance of a light relative to Observations::max_irradiance(): below it, a light may be interreflection.
constexpr double kMinRelativeIrradiance = 0.06;
/// The table reflects the same share of each light: largest ratio of a light's share to that of all light together, or
/// the reverse (texture, gloss, lights that clutter hides), for lights at least kMinReflectedElevation (sine) above it.
constexpr double kMaxAlbedoRatio = 6, kMinReflectedElevation = 0.08;
/// The same for the ambient light, if it has at least this share of the irradiance of the table.
constexpr double kMinAmbientShare = 0.2;
/// Rounds in which each light in turn is searched again, the others fixed.
constexpr int kMaxExchanges = 2;
/// Reduced chi square that no model is expected to fall below.
constexpr double kMinChiSquare = 0.05;
/// Smallest initial inverse distance, 1/m: at infinity the residuals depend least on it.
constexpr double kMinInitialInverseDistance = 0.5;

double mean(const Rgb& c) { return (c[0] + c[1] + c[2]) / 3; }

/// Whether all lights of a fit with the ground plane are above it, and it reflects similar shares of them and of the
/// ambient light.
bool table_is_consistent(const Fit& fit, const GroundGeometry& ground) {
  if (!fit.ground || fit.model.lights.empty()) return true;
  const Vec3d& normal = ground.normal;
  for (const PointLight& light : fit.model.lights)
    if (!(dot(light.direction, normal) + ground.height() * light.inverse_distance > 0)) return false;
  // Per light: irradiance of the table by the model of the faces, and its radiance.
  std::vector<std::array<double, 2>> shares;
  double incident = 0, reflected = 0;
  for (std::size_t k = 0; k < fit.model.lights.size(); ++k) {
    const double elevation = dot(fit.model.lights[k].direction, normal);
    if (elevation < kMinReflectedElevation) continue;
    shares.push_back({mean(fit.model.lights[k].irradiance) * elevation, fit.ground_irradiance[k] * elevation});
    incident += shares.back()[0], reflected += shares.back()[1];
  }
  const auto& a = fit.model.ambient;
  const double ambient = mean(a[0]) + mean(a[1]) * normal.x + mean(a[2]) * normal.y + mean(a[3]) * normal.z;
  incident += std::max(0.0, ambient), reflected += fit.ground_ambient;
  if (ambient > kMinAmbientShare * incident) shares.push_back({ambient, fit.ground_ambient});
  return std::ranges::all_of(shares, [&](const std::array<double, 2>& share) {
    return share[1] * incident * kMaxAlbedoRatio >= share[0] * reflected &&
           share[1] * incident <= kMaxAlbedoRatio * share[0] * reflected;
  });
}

}  // namespace

FitCandidates LightModelSelector::search(int max_lights) {
  add_fit(fit_lights(observations_, {}, {}, observation_set_, hull_));
  if (max_lights >= 1 && can_improve()) {
    for (const LightSearch::Candidate& one : light_search().find_single_lights(3, observation_set_))
      fit_from(one.lights);
    try_distant(1);
  }
  if (max_lights >= 2 && can_improve()) {
    for (const LightSearch::Candidate& two : light_search().find_light_pairs(4, observation_set_)) fit_from(two.lights);
    add_light(best_of_count(1));
    exchange_lights(2);
    try_distant(2);
  }
  for (std::size_t count = 3; count <= static_cast<std::size_t>(max_lights) && can_improve(); ++count) {
    add_light(best_of_count(count - 1));
    exchange_lights(count);
    try_distant(count);
  }
  FitCandidates out{best(), {}};
  for (std::size_t i = 0; i < fits_.size(); ++i)
    if (i != best_) out.others.push_back(fits_[i]);
  return out;
}

std::optional<FitCandidates> LightModelSelector::track(const LightingEstimate& previous) {
  std::vector<PointLight> lights;
  std::vector<Distance> distances;
  for (const LightEstimate& estimate : previous.lights) {
    lights.push_back(estimate.light);
    distances.push_back(estimate.distance_estimated ? Distance::free : Distance::infinite);
  }
  add_fit(fit_lights(observations_, std::move(lights), std::move(distances), observation_set_, hull_,
                     kMaxTrackingIterations));
  if (fits_.empty()) return std::nullopt;
  const double reduced = best().chi_square / std::max(1, best().observations - best().parameters);
  if (reduced > kMaxTrackingChiSquareRatio * std::max(previous.chi_square_at_search, kAcceptableChiSquare))
    return std::nullopt;
  return FitCandidates{best(), {}};
}

bool LightModelSelector::can_improve() const {
  const double reduced =
      (best().chi_square - best().ground_chi_square) / std::max(1, best().channels * best().face_samples);
  return reduced > kMinChiSquare || observation_set_ == ObservationSet::faces_and_ground_plane;
}

void LightModelSelector::add_fit(Fit fit) {
  for (const PointLight& light : fit.model.lights)
    if (luminance(light.irradiance) < kMinRelativeIrradiance * observations_.max_irradiance(0)) return;
  if (observations_.ground() != nullptr && !table_is_consistent(fit, *observations_.ground())) return;
  fits_.push_back(std::move(fit));
  if (fits_.size() == 1 || fits_.back().bic() < best().bic()) best_ = fits_.size() - 1;
}

void LightModelSelector::fit_from(std::vector<PointLight> lights) {
  for (PointLight& light : lights)
    light.inverse_distance = std::max(light.inverse_distance, kMinInitialInverseDistance);
  const std::vector<Distance> all_free(lights.size(), Distance::free);
  add_fit(fit_lights(observations_, std::move(lights), all_free, observation_set_, hull_));
}

const Fit* LightModelSelector::best_of_count(std::size_t count) const {
  const Fit* out = nullptr;
  for (const Fit& fit : fits_)
    if (fit.model.lights.size() == count && (out == nullptr || fit.deviance() < out->deviance())) out = &fit;
  return out;
}

void LightModelSelector::try_distant(std::size_t count) {
  const Fit* of_count = best_of_count(count);
  if (of_count == nullptr) return;
  const std::vector<PointLight> lights = of_count->model.lights;
  const auto with = [&](std::vector<Distance> distances) {
    std::vector<PointLight> start = lights;
    for (std::size_t k = 0; k < count; ++k)
      if (distances[k] == Distance::infinite) start[k].inverse_distance = 0;
    add_fit(fit_lights(observations_, start, distances, observation_set_, hull_));
  };
  with(std::vector<Distance>(count, Distance::infinite));
  if (count < 2) return;
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<Distance> one(count, Distance::infinite);
    one[k] = Distance::free;
    with(one);
  }
}

void LightModelSelector::add_light(const Fit* fit) {
  if (fit == nullptr) return;
  const std::vector<PointLight> lights = fit->model.lights;
  for (const LightSearch::Candidate& one : light_search().find_single_lights(3, observation_set_, lights)) {
    std::vector<PointLight> more = lights;
    more.push_back(one.lights[0]);
    fit_from(more);
  }
}

void LightModelSelector::exchange_lights(std::size_t count) {
  for (int round = 0; round < kMaxExchanges; ++round) {
    const Fit* start = best_of_count(count);
    if (start == nullptr) return;
    const double deviance = start->deviance();
    const std::vector<PointLight> lights = start->model.lights;
    for (std::size_t k = 0; k < count; ++k) {
      std::vector<PointLight> others = lights;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      for (const LightSearch::Candidate& one : light_search().find_single_lights(2, observation_set_, others)) {
        if (angle_between(one.lights[0].direction, lights[k].direction) < kMinSeparation_rad) continue;
        std::vector<PointLight> exchanged = others;
        exchanged.push_back(one.lights[0]);
        fit_from(exchanged);
      }
    }
    if (!(best_of_count(count)->deviance() < deviance)) return;
  }
}

}  // namespace lightwell::marker
