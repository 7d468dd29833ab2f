#include "tools/lightwell_eval/front.hpp"

#include <algorithm>
#include <cmath>

namespace lightwell::eval {
namespace {

constexpr double kClearTime = 0.95, kClearError = 0.98;

/// Whether `a` beats `b` where a cost counts as less below `clear` times the other.
bool beats(double cost_a, double error_a, double cost_b, double error_b, double clear) {
  return (kClearError * error_a <= error_b && cost_a < clear * cost_b) || (error_a < kClearError * error_b && cost_a <= cost_b);
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

void summarise(Row& row, double memcpy_seconds) {
  const auto over = [&](auto&& value) {
    std::vector<double> all;
    for (const Outcome& o : row.scenes) all.push_back(value(o));
    return all;
  };
  const auto most = [](const std::vector<double>& all) { return all.empty() ? 0 : *std::max_element(all.begin(), all.end()); };
  const double seconds = median(over([](const Outcome& o) { return o.seconds; }));
  row.ms = 1e3 * seconds;
  row.memcpy_ratio = seconds / memcpy_seconds;
  row.bytes = median(over([](const Outcome& o) { return o.bytes; }));
  const std::vector<double> rms = over([](const Outcome& o) { return o.rms; }),
                            largest = over([](const Outcome& o) { return o.largest; });
  row.rms = median(rms);
  row.worst_rms = most(rms);
  row.largest = median(largest);
  row.worst_largest = most(largest);
  std::vector<double> instructions, light, bounds;
  for (const Outcome& o : row.scenes) {
    if (o.instructions_per_pixel) instructions.push_back(*o.instructions_per_pixel);
    if (o.light_deg) light.push_back(*o.light_deg);
    if (std::isfinite(o.bound)) bounds.push_back(o.bound);
    row.unbounded_share += std::isfinite(o.bound) ? 0 : 1.0 / static_cast<double>(row.scenes.size());
  }
  if (!instructions.empty()) row.instructions_per_pixel = median(instructions);
  row.bound = median(bounds);
  if (!light.empty()) {
    row.light_deg = median(light);
    row.worst_light_deg = most(light);
  }
  for (std::size_t b = 0; b < kBalls; ++b) row.balls[b] = median(over([b](const Outcome& o) { return o.balls[b]; }));
}

void mark_fronts(std::span<Row> rows) {
  for (Row& b : rows) {
    b.on_time_front = b.on_bytes_front = true;
    for (const Row& a : rows) {
      if (&a == &b) continue;
      if (a.setup.rivals_in_time(b.setup) && beats(a.ms, a.rms, b.ms, b.rms, kClearTime)) b.on_time_front = false;
      if (a.setup.rivals_in_bytes(b.setup) && beats(a.bytes, a.rms, b.bytes, b.rms, 1)) b.on_bytes_front = false;
    }
  }
}

}  // namespace lightwell::eval
