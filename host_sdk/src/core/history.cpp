#include "core/history.hpp"

#include <algorithm>
#include <utility>

#include "core/interpolate.hpp"

namespace lightwell::core {
namespace {

Lighting held(std::shared_ptr<const Sample> sample, HostTime time, Duration max_age) {
  const Duration age = std::max(time - sample->mid_exposure, Duration{});
  const Validity validity = age > max_age ? Validity::stale : Validity::valid;
  return {std::move(sample), validity, age, max_age};
}

}  // namespace

std::shared_ptr<const History> appended(const History* before, std::shared_ptr<const Sample> sample,
                                        std::size_t capacity) {
  auto after = std::make_shared<History>();
  if (before != nullptr) {
    const auto& old = before->samples;
    const auto end = std::find_if(old.begin(), old.end(), [&](const auto& s) {
      return s->mid_exposure >= sample->mid_exposure;
    });
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

Lighting lighting_at(const History* history, HostTime time, Duration max_age) {
  if (history == nullptr) return {nullptr, Validity::none, {}, max_age};
  const auto& samples = history->samples;
  const auto next =
      std::upper_bound(samples.begin(), samples.end(), time,
                       [](HostTime t, const auto& sample) { return t < sample->mid_exposure; });
  if (next == samples.begin()) return {nullptr, Validity::before_history, {}, max_age};
  const std::shared_ptr<const Sample>& before = *(next - 1);
  if (next == samples.end() || before->mid_exposure == time) return held(before, time, max_age);

  const std::shared_ptr<const Sample>& after = *next;
  const Duration span = after->mid_exposure - before->mid_exposure;
  const Duration into = time - before->mid_exposure;
  const auto f = static_cast<float>(into.seconds() / span.seconds());
  Sample blended = sample_of(interpolated(before->descriptor, after->descriptor, f));
  const Sample& nearer = f < 0.5F ? *before : *after;
  blended.mid_exposure = time;
  blended.received = nearer.received;
  blended.encoded_bytes = nearer.encoded_bytes;
  blended.environment = nearer.environment;
  // How far the nearest measurement is: across a hole in the past the answer is a guess, and stale.
  const Duration age = std::min(into, span - into);
  const Validity validity = age > max_age ? Validity::stale : Validity::valid;
  return {std::make_shared<const Sample>(std::move(blended)), validity, age, max_age};
}

}  // namespace lightwell::core
