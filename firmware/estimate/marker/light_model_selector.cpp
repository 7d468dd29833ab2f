#include "estimate/marker/light_model_selector.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightwell::marker {
namespace {

/// Lamps are followed while chi square, over the degrees of freedom, is no more than so many times what it was, or what
/// is good anyway.
constexpr double kMaxTrackingChiSquareRatio = 1.5;
constexpr double kAcceptableChiSquare = 0.3;
/// From one frame to the next a fit is near its end when it begins.
constexpr int kTrackingIterations = 6;
/// A lamp is one where it gives at least this share of what the brightest face gets: less is what surfaces send to each
/// other.
constexpr double kMinRelativeIrradiance = 0.06;
/// Where a lamp's distance is begun at least, 1/m: at infinity its derivative tells least.
constexpr double kInitialInverseDistance = 0.5;

}  // namespace

FitCandidates LightModelSelector::seek() {
  add_fit(fit_lights(seen_, {}, {}, observation_set_, hull_, options_.fit));
  if (options_.max_lights >= 1 && can_improve()) {
    for (const LightSearch::Candidate& one : search().find_single_lights(3, observation_set_)) fit_from(one.lights);
    try_distant(1);
  }
  if (options_.max_lights >= 2 && can_improve()) {
    for (const LightSearch::Candidate& two : search().pairs(3)) fit_from(two.lights);
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

std::optional<FitCandidates> LightModelSelector::follow(const LightingEstimate& before) {
  std::vector<PointLight> lights;
  std::vector<Distance> distances;
  for (const LightEstimate& lamp : before.lights) {
    lights.push_back(lamp.lamp);
    distances.push_back(lamp.free ? Distance::free : Distance::infinite);
  }
  FitOptions few = options_.fit;
  few.iterations = std::min(few.iterations, kTrackingIterations);
  add_fit(fit_lights(seen_, std::move(lights), std::move(distances), observation_set_, hull_, few));
  if (fits_.empty()) return std::nullopt;
  const double reduced = best().chi_square / std::max(1, best().observations - best().parameters);
  if (reduced > kMaxTrackingChiSquareRatio * std::max(before.searched, kAcceptableChiSquare)) return std::nullopt;
  return FitCandidates{best(), {}};
}

LightSearch& LightModelSelector::search() {
  if (!search_) search_.emplace(seen_, hull_, options_.fit);
  return *search_;
}

const Fit& LightModelSelector::best() const { return fits_[best_]; }

bool LightModelSelector::can_improve() const {
  const double price = (2 + seen_.channels()) * std::log(std::max(best().observations, 2));
  return best().chi_square > price;
}

void LightModelSelector::add_fit(Fit fit) {
  for (const PointLight& lamp : fit.model.lights)
    if (luminance(lamp.irradiance) < kMinRelativeIrradiance * seen_.brightest(0)) return;
  fits_.push_back(std::move(fit));
  if (fits_.size() == 1 || fits_.back().bic() < best().bic()) best_ = fits_.size() - 1;
}

void LightModelSelector::fit_from(std::vector<PointLight> lights) {
  for (PointLight& lamp : lights) lamp.inverse_distance = std::max(lamp.inverse_distance, kInitialInverseDistance);
  const std::vector<Distance> free(lights.size(), Distance::free);
  add_fit(fit_lights(seen_, std::move(lights), free, observation_set_, hull_, options_.fit));
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
    add_fit(fit_lights(seen_, start, distances, observation_set_, hull_, options_.fit));
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
  for (const LightSearch::Candidate& one : search().find_single_lights(2, observation_set_, lights)) {
    std::vector<PointLight> more = lights;
    more.push_back(one.lights[0]);
    fit_from(more);
  }
}

}  // namespace lightwell::marker
