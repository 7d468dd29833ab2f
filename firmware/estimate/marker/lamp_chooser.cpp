#include "estimate/marker/lamp_chooser.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightwell::marker {
namespace {

/// Lamps are followed while chi square, over the degrees of freedom, is no more than so many times what it was, or what
/// is good anyway.
constexpr double kFollowed = 1.5;
constexpr double kGoodEnough = 0.3;
/// From one frame to the next a fit is near its end when it begins.
constexpr int kFollowSteps = 6;
/// A lamp is one where it gives at least this share of what the brightest face gets: less is what surfaces send to each
/// other.
constexpr double kFaintest = 0.06;
/// Where a lamp's distance is begun at least, 1/m: at infinity its derivative tells least.
constexpr double kFirstInverse = 0.5;

}  // namespace

Sought LampChooser::seek() {
  take(fit_lamps(seen_, {}, {}, witness_, hull_, options_.fit));
  if (options_.most_lamps >= 1 && worth_more()) {
    for (const LightSearch::Candidate& one : search().singles(3, witness_)) try_places(one.lamps);
    simplify(1);
  }
  if (options_.most_lamps >= 2 && worth_more()) {
    for (const LightSearch::Candidate& two : search().pairs(3)) try_places(two.lamps);
    if (best().model.lamps.size() == 1) try_beside(best().model.lamps);
    simplify(2);
  }
  for (std::size_t count = 3; count <= static_cast<std::size_t>(options_.most_lamps) && worth_more(); ++count) {
    if (best().model.lamps.size() + 1 != count) break;
    try_beside(best().model.lamps);
    simplify(count);
  }
  Sought out{best(), {}};
  for (std::size_t i = 0; i < fits_.size(); ++i)
    if (i != best_) out.others.push_back(fits_[i]);
  return out;
}

std::optional<Sought> LampChooser::follow(const ChosenLight& before) {
  std::vector<Lamp> lamps;
  std::vector<Distance> distances;
  for (const ChosenLamp& lamp : before.lamps) {
    lamps.push_back(lamp.lamp);
    distances.push_back(lamp.free ? Distance::free : Distance::infinite);
  }
  FitOptions few = options_.fit;
  few.iterations = std::min(few.iterations, kFollowSteps);
  take(fit_lamps(seen_, std::move(lamps), std::move(distances), witness_, hull_, few));
  if (fits_.empty()) return std::nullopt;
  const double reduced = best().chi_square / std::max(1, best().observations - best().parameters);
  if (reduced > kFollowed * std::max(before.searched, kGoodEnough)) return std::nullopt;
  return Sought{best(), {}};
}

LightSearch& LampChooser::search() {
  if (!search_) search_.emplace(seen_, hull_, options_.fit);
  return *search_;
}

const Fit& LampChooser::best() const { return fits_[best_]; }

bool LampChooser::worth_more() const {
  const double price = (2 + seen_.channels()) * std::log(std::max(best().observations, 2));
  return best().chi_square > price;
}

void LampChooser::take(Fit fit) {
  for (const Lamp& lamp : fit.model.lamps)
    if (luminance(lamp.irradiance) < kFaintest * seen_.brightest(0)) return;
  fits_.push_back(std::move(fit));
  if (fits_.size() == 1 || fits_.back().bic() < best().bic()) best_ = fits_.size() - 1;
}

void LampChooser::try_places(std::vector<Lamp> lamps) {
  for (Lamp& lamp : lamps) lamp.inverse_distance = std::max(lamp.inverse_distance, kFirstInverse);
  const std::vector<Distance> free(lamps.size(), Distance::free);
  take(fit_lamps(seen_, std::move(lamps), free, witness_, hull_, options_.fit));
}

void LampChooser::simplify(std::size_t count) {
  const Fit* of_count = nullptr;
  for (const Fit& fit : fits_)
    if (fit.model.lamps.size() == count && (of_count == nullptr || fit.chi_square < of_count->chi_square))
      of_count = &fit;
  if (of_count == nullptr) return;
  const std::vector<Lamp> lamps = of_count->model.lamps;
  const auto with = [&](std::vector<Distance> distances) {
    std::vector<Lamp> start = lamps;
    for (std::size_t k = 0; k < count; ++k)
      if (distances[k] == Distance::infinite) start[k].inverse_distance = 0;
    take(fit_lamps(seen_, start, distances, witness_, hull_, options_.fit));
  };
  with(std::vector<Distance>(count, Distance::infinite));
  if (count < 2) return;
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<Distance> one(count, Distance::infinite);
    one[k] = Distance::free;
    with(one);
  }
}

void LampChooser::try_beside(std::vector<Lamp> lamps) {
  for (const LightSearch::Candidate& one : search().singles(2, witness_, lamps)) {
    std::vector<Lamp> more = lamps;
    more.push_back(one.lamps[0]);
    try_places(more);
  }
}

}  // namespace lightwell::marker
