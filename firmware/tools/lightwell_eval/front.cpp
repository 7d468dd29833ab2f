#include "tools/lightwell_eval/front.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <lightwell/quantile.hpp>

namespace lightwell::eval {
namespace {

constexpr double kClearInstructions = 0.98, kClearBytes = 0.98;

bool clearly_less(double a, double b, double clear) { return a < clear * b; }

/// Whether both rows have the same bytes, errors and bound in every scene.
bool same_results(const Row& a, const Row& b) {
  return !a.scenes.empty() && std::ranges::equal(a.scenes, b.scenes, [](const Outcome& x, const Outcome& y) {
    return x.bytes == y.bytes && x.rms == y.rms && x.largest == y.largest && x.bound == y.bound;
  });
}

/// Clearly less time and, if counted, also clearly fewer instructions: times may differ for the same work.
bool clearly_quicker(const Row& a, const Row& b) {
  if (a.instructions_per_pixel && b.instructions_per_pixel)
    return clearly_less(a.ms, b.ms, kClearTime) &&
           clearly_less(*a.instructions_per_pixel, *b.instructions_per_pixel, kClearInstructions);
  return clearly_less(a.ms, b.ms, same_results(a, b) ? kClearTimeSameResults : kClearTime);
}

bool clearly_better(const Row& a, const Row& b) {
  return clearly_quicker(a, b) || clearly_less(a.bytes, b.bytes, kClearBytes) ||
         clearly_less(a.rms, b.rms, kClearError) ||
         clearly_less(a.bound_or_infinity(), b.bound_or_infinity(), kClearError);
}

bool dominates(const Row& a, const Row& b) { return clearly_better(a, b) && !clearly_better(b, a); }

}  // namespace

void summarise(Row& row, double memcpy_seconds) {
  const auto over = [&](auto&& value) {
    std::vector<double> all;
    for (const Outcome& o : row.scenes) all.push_back(value(o));
    return all;
  };
  const auto largest_of = [](const std::vector<double>& all) {
    return all.empty() ? 0 : *std::max_element(all.begin(), all.end());
  };
  const double seconds = median(over([](const Outcome& o) { return o.seconds; }));
  row.ms = 1e3 * seconds;
  row.memcpy_ratio = seconds / memcpy_seconds;
  row.bytes = median(over([](const Outcome& o) { return o.bytes; }));
  std::vector<double> rms = over([](const Outcome&o) { return o.rms; }),
                      largest = over([](const Outcome&o) { return o.largest; });
  row.rms = median(rms);
  row.worst_rms = largest_of(rms);
  row.largest = median(largest);
  row.worst_largest = largest_of(largest);
  std::vector<double> instructions, light, bounds;
  for (const Outcome& o : row.scenes) {
    if (o.instructions_per_pixel) instructions.push_back(*o.instructions_per_pixel);
    if (o.light_deg) light.push_back(*o.light_deg);
    if (std::isfinite(o.bound)) bounds.push_back(o.bound);
    row.unbounded_share += std::isfinite(o.bound) ? 0 : 1.0 / static_cast<double>(row.scenes.size());
  }
  if (!instructions.empty()) row.instructions_per_pixel = median(instructions);
  row.bound = bounds.empty() ? 0 : median(bounds);
  if (!light.empty()) {
    row.light_deg = median(light);
    row.worst_light_deg = largest_of(light);
  }
  for (std::size_t b = 0; b < kBalls; ++b) row.balls[b] = median(over([b](const Outcome& o) { return o.balls[b]; }));
}

void mark_front(std::span<Row> rows) {
  for (Row& b : rows)
    b.on_front = std::none_of(rows.begin(), rows.end(),
                              [&](const Row& a) { return a.setup.competes_with(b.setup) && dominates(a, b); });
}

}  // namespace lightwell::eval
