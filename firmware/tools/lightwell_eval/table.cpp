#include "tools/lightwell_eval/table.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "tools/json_text.hpp"

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

std::string camera_of(const Case& c) {
  return formatted("%dx%d%s", c.width, c.height,
                   c.sensor == Sensor::ideal ? ""
                   : c.exposures == 1        ? " 8 bit"
                                             : " 8 bit x3");
}

TableLine line_of(const Row& r) {
  return {r.setup.label,
          camera_of(r.setup),
          formatted("%.2f", r.ms),
          formatted("%.2f", r.memcpy_ratio),
          r.instructions_per_pixel ? formatted("%.1f", *r.instructions_per_pixel) : "not available here",
          formatted("%.0f", r.bytes),
          percent(r.rms) + " / " + percent(r.worst_rms),
          percent(r.largest) + " / " + percent(r.worst_largest),
          r.light_deg ? formatted("%.2f / %.2f", *r.light_deg, *r.worst_light_deg) : "-",
          percent(r.balls[0]) + " / " + percent(r.balls[1]) + " / " + percent(r.balls[2]),
          !std::isfinite(r.bound_or_infinity()) ? "none" : percent(r.bound) + (r.unbounded_share > 0 ? "*" : ""),
          r.on_front ? "yes" : ""};
}

nlohmann::ordered_json json_of(const Outcome& o) {
  return {{"ms", 1e3 * o.seconds},
          {"instructions_per_pixel", json_or_null(o.instructions_per_pixel)},
          {"bytes", std::llround(o.bytes)},
          {"rms", o.rms},
          {"largest", o.largest},
          {"light_deg", json_or_null(o.light_deg)},
          {"balls", o.balls},
          {"bound", o.bound},
          {"map", o.map}};
}

nlohmann::ordered_json json_of(const Row& r) {
  const Case& c = r.setup;
  nlohmann::ordered_json outcomes = nlohmann::ordered_json::array();
  for (const Outcome& o : r.scenes) outcomes.push_back(json_of(o));
  return {{"what", c.label},
          {"knob", c.parameter},
          {"width", c.width},
          {"height", c.height},
          {"sensor", c.sensor == Sensor::ideal ? "ideal" : "rgb8"},
          {"setting", to_string(c.config.setting)},
          {"block_edge", c.block_edge},
          {"band", c.config.band},
          {"max_lights", c.config.max_lights},
          {"epsilon", c.config.panorama.epsilon},
          {"environment_edge", c.config.panorama.environment_edge},
          {"exposures", c.exposures},
          {"named", c.named},
          {"ms", r.ms},
          {"memcpy_ratio", r.memcpy_ratio},
          {"bytes", r.bytes},
          {"rms", r.rms},
          {"on_front", r.on_front},
          {"outcomes", std::move(outcomes)}};
}

}  // namespace

void summarise(Row& row, double memcpy_seconds) {
  // The values that exist.
  const auto over = [&](const auto& value) {
    std::vector<double> all;
    for (const Outcome& o : row.scenes)
      if (const std::optional<double> v = std::invoke(value, o)) all.push_back(*v);
    return all;
  };
  const double seconds = median(over(&Outcome::seconds));
  row.ms = 1e3 * seconds;
  row.memcpy_ratio = seconds / memcpy_seconds;
  row.bytes = median(over(&Outcome::bytes));
  std::vector<double> rms = over(&Outcome::rms), largest = over(&Outcome::largest);
  row.rms = median(rms);
  row.worst_rms = std::ranges::max(rms);
  row.largest = median(largest);
  row.worst_largest = std::ranges::max(largest);
  std::vector<double> instructions = over(&Outcome::instructions_per_pixel), light = over(&Outcome::light_deg),
                      bounds = over([](const Outcome&o) {
                        return std::isfinite(o.bound) ? std::optional(o.bound) : std::nullopt;
                      });
  if (!instructions.empty()) row.instructions_per_pixel = median(instructions);
  row.bound = bounds.empty() ? 0 : median(bounds);
  for (const Outcome& o : row.scenes)
    row.unbounded_share += std::isfinite(o.bound) ? 0 : 1.0 / static_cast<double>(row.scenes.size());
  if (!light.empty()) {
    row.light_deg = median(light);
    row.worst_light_deg = std::ranges::max(light);
  }
  for (std::size_t b = 0; b < kBalls; ++b) row.balls[b] = median(over([b](const Outcome& o) { return o.balls[b]; }));
}

void mark_front(std::span<Row> rows) {
  for (Row& b : rows)
    b.on_front = std::none_of(rows.begin(), rows.end(),
                              [&](const Row& a) { return a.setup.competes_with(b.setup) && dominates(a, b); });
}

std::string percent(double share) { return formatted(share < 0.1 ? "%.2f" : share < 1 ? "%.1f" : "%.0f", 100 * share); }

std::string markdown_table(std::span<const TableLine> lines, std::size_t left) {
  std::vector<std::size_t> widths(lines.front().size());
  for (const TableLine& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) widths[k] = std::max(widths[k], line[k].size());
  const auto at_left = [&](std::size_t k) { return k < left || k + 1 == widths.size(); };
  std::string out;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    for (std::size_t k = 0; k < widths.size(); ++k) {
      const std::string space(widths[k] - lines[n][k].size(), ' ');
      out += "| ";
      out += at_left(k) ? lines[n][k] + space : space + lines[n][k];
      out += " ";
    }
    out += "|\n";
    if (n > 0) continue;
    for (std::size_t k = 0; k < widths.size(); ++k) {
      out += "| ";
      out.append(widths[k] - 1, '-');
      out += at_left(k) ? "- " : ": ";
    }
    out += "|\n";
  }
  return out;
}

std::string table_of(std::span<const Row> rows, const Run& run) {
  std::vector<TableLine> lines = {{"what", "camera, a pair of", "ms", "x memcpy", "instr/px", "bytes", "RMS %",
                                   "largest %", "light deg", "balls %", "bound %", "front"}};
  for (const Row& row : rows) lines.push_back(line_of(row));
  std::string out = markdown_table(lines, 2);
  out += formatted("\n%zu scenes: ", run.scenes.size()) + joined(run.scenes) + ".\n" +
         formatted("memcpy here: %.2f GB/s (best of %s passes over 32 buffers of the default camera's pictures). ",
                   run.memcpy_gb_per_s, run.quick ? "two" : "five") +
         "Times: one thread, rgb8 pictures,\nfrom frame to encoded bytes, best of each buffer, median of the scenes; "
         "relative to memcpy of the same bytes.\nRMS, largest: error of the decoded irradiance relative to its RMS, "
         "median / worst scene; with an ideal sensor unless\nthe camera is 8 bit. light: direction error of the "
         "brightest region if it is 100 times the mean, median / worst.\nballs: diffuse / matte silver / mirror, "
         "relative RMSE of linear pictures, median. bound: the descriptor's error bound, median; *: some scenes have "
         "none.\nfront: no other row of the same camera has less of ms, bytes, RMS or bound and no more of the others. "
         "Differences below 5 % of time and 2 % of the others\nare ignored.\n";
  std::string off;
  for (const Row& row : rows)
    if (row.setup.named && !row.on_front) off += (off.empty() ? "" : ", ") + row.setup.label;
  out += off.empty() ? "All named settings are on the measured front.\n" : "NOT on the measured front: " + off + ".\n";
  for (const Row& row : rows) {
    if (row.setup.config.panorama.environment_edge == 0) continue;
    if (std::none_of(row.scenes.begin(), row.scenes.end(), [](const Outcome& o) { return o.map; }))
      out += "'" + row.setup.label + "' has no whole environment map: this row is the same as without one.\n";
  }
  return out;
}

nlohmann::ordered_json json_of(std::span<const Row> rows, const Run& run, std::span<const MarkerRow> marker) {
  nlohmann::ordered_json out = {
      {"scenes", run.scenes}, {"memcpy_gb_per_s", run.memcpy_gb_per_s}, {"rows", nlohmann::ordered_json::array()}};
  for (const Row& row : rows) out["rows"].push_back(json_of(row));
  if (!marker.empty()) out["marker"] = json_of(marker);
  return out;
}

}  // namespace lightwell::eval
