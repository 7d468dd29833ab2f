#include "estimate/marker/light_model_selector.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightwell::marker {
namespace {

/// Tracking is accepted while the reduced chi square is at most this ratio times that of the last search, or times
/// kAcceptableChiSquare if that is larger.
constexpr double kMaxTrackingChiSquareRatio = 1.5;
constexpr double kAcceptableChiSquare = 0.3;
/// Iterations of a tracking fit, which starts near the minimum.
constexpr int kTrackingIterations = 6;
/// Smallest irradiance of a light relative to Observations::max_irradiance(): below it, a light may be interreflection.
constexpr double kMinRelativeIrradiance = 0.06;
/// Smallest initial inverse distance, 1/m: at infinity the residuals depend least on it.
constexpr double kMinInitialInverseDistance = 0.5;

}  // namespace

FitCandidates LightModelSelector::search() {
  add_fit(fit_lights(observations_, {}, {}, observation_set_, hull_, options_.fit));
  if (options_.max_lights >= 1 && can_improve()) {
    for (const LightSearch::Candidate& one : light_search().find_single_lights(3, observation_set_))
      fit_from(one.lights);
    try_distant(1);
  }
  if (options_.max_lights >= 2 && can_improve()) {
    for (const LightSearch::Candidate& two : light_search().find_light_pairs(3)) fit_from(two.lights);
    if (best().model.lights.size() == 1) add_light(best().model.lights);
    try_distant(2);
  }
  for (std::size_t count = 3; count <= static_cast<std::size_t>(options_.max_lights) && can_improve(); ++count) {
    if (best().model.lights.size() + 1 != count) break;
    add_light(best().model.lights);
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
  FitOptions few = options_.fit;
  few.iterations = std::min(few.iterations, kTrackingIterations);
  add_fit(fit_lights(observations_, std::move(lights), std::move(distances), observation_set_, hull_, few));
  if (fits_.empty()) return std::nullopt;
  const double reduced = best().chi_square / std::max(1, best().observations - best().parameters);
  if (reduced > kMaxTrackingChiSquareRatio * std::max(previous.chi_square_at_search, kAcceptableChiSquare))
    return std::nullopt;
  return FitCandidates{best(), {}};
}

LightSearch& LightModelSelector::light_search() {
  if (!light_search_) light_search_.emplace(observations_, hull_, options_.fit);
  return *light_search_;
}

const Fit& LightModelSelector::best() const { return fits_[best_]; }

bool LightModelSelector::can_improve() const {
  const double price = (2 + observations_.channels()) * std::log(std::max(best().observations, 2));
  return best().chi_square > price;
}

void LightModelSelector::add_fit(Fit fit) {
  for (const PointLight& light : fit.model.lights)
    if (luminance(light.irradiance) < kMinRelativeIrradiance * observations_.max_irradiance(0)) return;
  fits_.push_back(std::move(fit));
  if (fits_.size() == 1 || fits_.back().bic() < best().bic()) best_ = fits_.size() - 1;
}

void LightModelSelector::fit_from(std::vector<PointLight> lights) {
  for (PointLight& light : lights)
    light.inverse_distance = std::max(light.inverse_distance, kMinInitialInverseDistance);
  const std::vector<Distance> all_free(lights.size(), Distance::free);
  add_fit(fit_lights(observations_, std::move(lights), all_free, observation_set_, hull_, options_.fit));
}

void LightModelSelector::try_distant(std::size_t count) {
  const Fit* of_count = nullptr;
  for (const Fit& fit : fits_)
    if (fit.model.lights.size() == count && (of_count == nullptr || fit.chi_square < of_count->chi_square))
      of_count = &fit;
  if (of_count == nullptr) return;
  const std::vector<PointLight> lights = of_count->model.lights;
  const auto with = [&](std::vector<Distance> distances) {
    std::vector<PointLight> start = lights;
    for (std::size_t k = 0; k < count; ++k)
      if (distances[k] == Distance::infinite) start[k].inverse_distance = 0;
    add_fit(fit_lights(observations_, start, distances, observation_set_, hull_, options_.fit));
  };
  with(std::vector<Distance>(count, Distance::infinite));
  if (count < 2) return;
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<Distance> one(count, Distance::infinite);
    one[k] = Distance::free;
    with(one);
  }
}

void LightModelSelector::add_light(std::vector<PointLight> lights) {
  for (const LightSearch::Candidate& one : light_search().find_single_lights(2, observation_set_, lights)) {
    std::vector<PointLight> more = lights;
    more.push_back(one.lights[0]);
    fit_from(more);
  }
}

}  // namespace lightwell::marker
