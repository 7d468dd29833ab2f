#include "core/history.hpp"

#include <algorithm>
#include <utility>

#include "core/interpolate.hpp"

namespace lightwell::core {
namespace {

/// Stale if the age can exceed max_age within the clock uncertainty.
Validity validity_of(Duration age, const Sample& sample, Duration max_age) {
  return age + sample.time_uncertainty > max_age ? Validity::stale : Validity::valid;
}

Lighting held(std::shared_ptr<const Sample> sample, HostTime time, Duration max_age,
              Derivation derivation = Derivation::measured) {
  const Duration age = std::max(time - sample->mid_exposure, Duration{});
  const Validity validity = validity_of(age, *sample, max_age);
  return {std::move(sample), validity, age, max_age, derivation};
}

/// Sample of an interpolated or extrapolated descriptor; all that is not derived from it is copied from `nearer`.
std::shared_ptr<const Sample> made_of(Descriptor descriptor, const Sample& nearer,
                                      LazyReconstruction::Pointer reconstruction, HostTime time) {
  Sample made = sample_of(std::move(descriptor));
  made.reconstruction = std::move(reconstruction);
  made.mid_exposure = time;
  made.time_uncertainty = nearer.time_uncertainty;
  made.received = nearer.received;
  made.encoded_bytes = nearer.encoded_bytes;
  made.environment = nearer.environment;
  made.environment_rotation = nearer.environment_rotation;
  made.T_world_probe = nearer.T_world_probe;
  // The nearer sample has no map, and the other one had a map or other units.
  if (!made.reconstruction) add_reconstruction(made);
  return std::make_shared<const Sample>(std::move(made));
}

Lighting beyond_newest(const History& history, HostTime time, Duration max_age, Duration extrapolation) {
  const auto& samples = history.samples;
  const std::shared_ptr<const Sample>& newest = samples.back();
  const Duration ahead = time - newest->mid_exposure;
  if (ahead > extrapolation) return held(newest, time, max_age, Derivation::held);
  // Measure the velocity over at least the extrapolated time: a shorter baseline would amplify the noise.
  const auto from = std::upper_bound(samples.begin(), samples.end() - 1, newest->mid_exposure - ahead,
                                     [](HostTime t, const auto& sample) { return t < sample->mid_exposure; });
  if (from == samples.begin()) return held(newest, time, max_age, Derivation::held);
  const Sample& before = **(from - 1);
  const Duration back = newest->mid_exposure - before.mid_exposure;
  // No extrapolation across a gap, in which the motion of the lights is unknown.
  if (back > max_age) return held(newest, time, max_age, Derivation::held);
  const auto f = static_cast<float>(ahead.seconds() / back.seconds());
  const Validity validity = validity_of(ahead, *newest, max_age);
  return {made_of(extrapolated(before.descriptor, newest->descriptor, f), *newest, newest->reconstruction, time),
          validity, ahead, max_age, Derivation::extrapolated};
}

}  // namespace

std::shared_ptr<const History> appended(const History* before, std::shared_ptr<const Sample> sample,
                                        std::size_t capacity) {
  auto after = std::make_shared<History>();
  if (before != nullptr) {
    const auto& old = before->samples;
    const auto end =
        std::find_if(old.begin(), old.end(), [&](const auto& s) { return s->mid_exposure >= sample->mid_exposure; });
    const auto count = std::min(static_cast<std::size_t>(end - old.begin()), capacity - 1);
    after->samples.reserve(count + 1);
    after->samples.assign(end - static_cast<std::ptrdiff_t>(count), end);
  }
  after->samples.push_back(std::move(sample));
  return after;
}

Lighting newest_lighting(const History* history, HostTime now, Duration max_age) {
  if (history == nullptr) return {nullptr, Validity::none, {}, max_age};
  return held(history->samples.back(), now, max_age);
}

Lighting lighting_at(const History* history, HostTime time, Duration max_age, Duration extrapolation) {
  if (history == nullptr) return {nullptr, Validity::none, {}, max_age};
  const auto& samples = history->samples;
  const auto next = std::upper_bound(samples.begin(), samples.end(), time,
                                     [](HostTime t, const auto& sample) { return t < sample->mid_exposure; });
  if (next == samples.begin()) return {nullptr, Validity::before_history, {}, max_age};
  const std::shared_ptr<const Sample>& before = *(next - 1);
  if (before->mid_exposure == time) return held(before, time, max_age);
  if (next == samples.end()) return beyond_newest(*history, time, max_age, extrapolation);

  const std::shared_ptr<const Sample>& after = *next;
  const Duration span = after->mid_exposure - before->mid_exposure;
  const Duration into = time - before->mid_exposure;
  const auto f = static_cast<float>(into.seconds() / span.seconds());
  const Sample& nearer = f < 0.5F ? *before : *after;
  // Time to the nearest descriptor: inside a long gap an interpolated answer is stale.
  const Duration age = std::min(into, span - into);
  const Validity validity = validity_of(age, nearer, max_age);
  LazyReconstruction::Pointer reconstruction;
  if (before->reconstruction && after->reconstruction && blends(before->descriptor, after->descriptor))
    reconstruction = std::make_shared<const LazyReconstruction>(before->reconstruction, after->reconstruction, f);
  return {made_of(interpolated(before->descriptor, after->descriptor, f), nearer, std::move(reconstruction), time),
          validity, age, max_age, Derivation::interpolated};
}

}  // namespace lightwell::core
