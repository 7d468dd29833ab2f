#include "tools/lightwell_eval/table.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/json.hpp>

#include "tools/lightwell_eval/formatting.hpp"

namespace lightwell::eval {
namespace {

std::string camera_of(const Case& c) {
  return text("%dx%d%s", c.width, c.height, c.sensor == Sensor::ideal ? "" : c.exposures == 1 ? " 8 bit" : " 8 bit x3");
}

TableLine line_of(const Row& r) {
  return {r.setup.label,
          camera_of(r.setup),
          text("%.2f", r.ms),
          text("%.2f", r.memcpy_ratio),
          r.instructions_per_pixel ? text("%.1f", *r.instructions_per_pixel) : "not available here",
          text("%.0f", r.bytes),
          percent(r.rms) + " / " + percent(r.worst_rms),
          percent(r.largest) + " / " + percent(r.worst_largest),
          r.light_deg ? text("%.2f / %.2f", *r.light_deg, *r.worst_light_deg) : "-",
          percent(r.balls[0]) + " / " + percent(r.balls[1]) + " / " + percent(r.balls[2]),
          !std::isfinite(r.bound_or_infinity()) ? "none" : percent(r.bound) + (r.unbounded_share > 0 ? "*" : ""),
          r.on_front ? "yes" : ""};
}

std::string json_of(const Outcome& o) {
  return text("{\"ms\": %s, \"instructions_per_pixel\": %s, \"bytes\": %.0f, \"rms\": %s, \"largest\": %s, ",
              number(1e3 * o.seconds).c_str(), number(o.instructions_per_pixel).c_str(), o.bytes, number(o.rms).c_str(),
              number(o.largest).c_str()) +
         text("\"light_deg\": %s, \"balls\": [%s, %s, %s], \"bound\": %s, \"map\": %s}", number(o.light_deg).c_str(),
              number(o.balls[0]).c_str(), number(o.balls[1]).c_str(), number(o.balls[2]).c_str(),
              number(o.bound).c_str(), o.map ? "true" : "false");
}

std::string config_of(const Case& c) {
  return text(
      "\"setting\": \"%s\", \"block_edge\": %d, \"band\": %d, \"max_lights\": %d, \"epsilon\": %g, "
      "\"environment_edge\": %d, \"exposures\": %d, \"named\": %s",
      std::string(to_string(c.config.setting)).c_str(), c.block_edge, c.config.band, c.config.max_lights,
      c.config.panorama.epsilon, c.config.panorama.environment_edge, c.exposures, c.named ? "true" : "false");
}

}  // namespace

std::string table_of(std::span<const Row> rows, const Run& run) {
  std::vector<TableLine> lines = {{"what", "camera, a pair of", "ms", "x memcpy", "instr/px", "bytes", "RMS %",
                                   "largest %", "light deg", "balls %", "bound %", "front"}};
  for (const Row& row : rows) lines.push_back(line_of(row));
  std::string out = markdown_table(lines, 2);
  std::string scenes;
  for (const std::string& s : run.scenes) scenes += (scenes.empty() ? "" : ", ") + s;
  out +=
      text("\n%zu scenes: ", run.scenes.size()) + scenes + ".\n" +
      text("memcpy here: %.2f GB/s (best of %s passes over 32 buffers of the default camera's pictures). ",
           run.memcpy_gb_per_s, run.quick ? "two" : "five") +
      "Times: one thread, rgb8 pictures,\nfrom frame to encoded bytes, best of each buffer, median of the scenes; "
      "relative to memcpy of "
      "the same bytes.\nRMS, largest: error of the decoded irradiance relative to its RMS, median / worst scene; with "
      "an ideal "
      "sensor unless\nthe camera is 8 bit. light: direction error of the brightest region if it is 100 times the "
      "mean, "
      "median / worst.\nballs: diffuse / matte silver / mirror, relative RMSE of linear pictures, median. bound: the "
      "descriptor's error bound, median; *: some scenes have none.\nfront: no other row "
      "of the same camera has less of ms, bytes, RMS or bound and no more of the others. Differences below 5 % of time "
      "and 2 % of the others\nare ignored.\n";
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

std::string json_of(std::span<const Row> rows, const Run& run, std::span<const MarkerRow> marker) {
  std::string out = "{\"scenes\": [";
  for (std::size_t i = 0; i < run.scenes.size(); ++i) out += (i > 0 ? ", " : "") + json_string(run.scenes[i]);
  out += text("], \"memcpy_gb_per_s\": %s, \"rows\": [", number(run.memcpy_gb_per_s).c_str());
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const Row& r = rows[n];
    out += (n > 0 ? ",\n" : "\n") + std::string("{\"what\": ") + json_string(r.setup.label) +
           ", \"knob\": " + json_string(std::string(to_string(r.setup.parameter))) +
           text(", \"width\": %d, \"height\": %d, \"sensor\": \"%s\", ", r.setup.width, r.setup.height,
                r.setup.sensor == Sensor::ideal ? "ideal" : "rgb8") +
           config_of(r.setup) +
           text(", \"ms\": %s, \"memcpy_ratio\": %s, \"bytes\": %s, \"rms\": %s, \"on_front\": %s",
                number(r.ms).c_str(), number(r.memcpy_ratio).c_str(), number(r.bytes).c_str(), number(r.rms).c_str(),
                r.on_front ? "true" : "false") +
           ", \"outcomes\": [";
    for (std::size_t k = 0; k < r.scenes.size(); ++k) out += (k > 0 ? ", " : "") + json_of(r.scenes[k]);
    out += "]}";
  }
  out += "\n]";
  if (!marker.empty()) out += ",\n\"marker\": " + marker_json_of(marker);
  return out + "}\n";
}

}  // namespace lightwell::eval
