#include "estimate/marker/light_model_selector.hpp"

#include <algorithm>
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
/// Smallest sine of the elevation of a light above the ground plane, seen from the body's foot: 3 degrees.
constexpr double kMinElevation = 0.05;
/// Smallest angle between two lights.
constexpr double kMinLightSeparation_rad = 0.26;
/// Rounds in which each light in turn is searched again, the others fixed.
constexpr int kMaxExchanges = 2;
/// Reduced chi square that no model is expected to fall below.
constexpr double kMinChiSquare = 0.05;
/// Smallest initial inverse distance, 1/m: at infinity the residuals depend least on it.
constexpr double kMinInitialInverseDistance = 0.5;

/// Whether two lights are so close together that they are one that is wide.
bool are_merged(const std::vector<PointLight>& lights) {
  for (std::size_t k = 0; k < lights.size(); ++k)
    for (std::size_t i = 0; i < k; ++i)
      if (angle_between(lights[i].direction, lights[k].direction) < kMinLightSeparation_rad) return true;
  return false;
}

/// Whether the ground plane can show all lights of a fit: at the horizon, a light hardly illuminates it.
bool are_above(const std::vector<PointLight>& lights, const GroundGeometry& ground) {
  return std::ranges::all_of(lights, [&](const PointLight& light) {
    return dot(light.direction, ground.normal) + ground.height() * light.inverse_distance > kMinElevation;
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
  if (are_merged(fit.model.lights)) return;
  if (fit.ground && !are_above(fit.model.lights, *observations_.ground())) return;
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
