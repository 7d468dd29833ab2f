#include "tools/lightwell_eval/table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "tools/command_line.hpp"

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

constexpr std::array kSweepParameters = {"setting", "decimation", "search", "faces", "order"};

/// Smallest significant difference of the share of flagged or unanswered frames.
constexpr double kClearShare = 0.01;

/// The numbers of a row that may be missing, in the order of the JSON.
struct NumberField {
  const char* name;
  std::optional<double> MarkerRow::*value;
  bool positive = false;  ///< A value on a logarithmic axis.
};
constexpr std::array<NumberField, 7> kNumbers = {{{"ms", &MarkerRow::ms, true},
                                                  {"ms_first", &MarkerRow::ms_first},
                                                  {"memcpy_ratio", &MarkerRow::memcpy_ratio},
                                                  {"rms", &MarkerRow::rms, true},
                                                  {"worst_rms", &MarkerRow::worst_rms},
                                                  {"direction_deg", &MarkerRow::direction_deg},
                                                  {"worst_direction_deg", &MarkerRow::worst_direction_deg}}};

std::string quoted(const std::string& name) { return formatted("\"%s\"", name.c_str()); }

/// Reads a line. Throws the first error.
MarkerRow row_of(const std::string& line) {
  std::set<std::string> names;
  const auto find_repeated = [&](int, nlohmann::ordered_json::parse_event_t event, const nlohmann::ordered_json& key) {
    if (event == nlohmann::ordered_json::parse_event_t::key && !names.insert(key.get<std::string>()).second)
      refuse(quoted(key.get<std::string>()) + " is there twice");
    return true;
  };
  nlohmann::ordered_json object = nlohmann::ordered_json::parse(line, find_repeated);
  if (!object.is_object()) refuse("not a JSON object");

  // Removes and returns a member.
  const auto take = [&](const std::string& name) {
    if (!object.contains(name)) refuse("it lacks " + quoted(name));
    nlohmann::ordered_json value = object[name];
    object.erase(name);
    return value;
  };
  const auto string = [&](const std::string& name) {
    const nlohmann::ordered_json value = take(name);
    if (!value.is_string() || value == "") refuse(quoted(name) + " is not a string");
    return value.get<std::string>();
  };
  const auto optional_number = [&](const std::string& name) -> std::optional<double> {
    const nlohmann::ordered_json value = take(name);
    if (value.is_null()) return std::nullopt;
    if (!value.is_number()) refuse(quoted(name) + " is not a number");
    if (value < 0) refuse(quoted(name) + " is negative");
    return value.get<double>();
  };
  const auto number = [&](const std::string& name, double most) {
    const std::optional<double> v = optional_number(name);
    if (!v || *v > most) refuse(quoted(name) + " must be a number of at most " + formatted("%g", most));
    return *v;
  };
  const auto pixels = [&](const std::string& name) {
    const double v = number(name, 1e5);
    if (v < 1 || v != std::floor(v)) refuse(quoted(name) + " must be a whole number of pixels");
    return static_cast<int>(v);
  };
  MarkerRow row;
  row.what = string("what");
  row.parameter = string("knob");
  if (std::ranges::find(kSweepParameters, row.parameter) == kSweepParameters.end())
    refuse("no knob '" + row.parameter + "'; there are " + joined(kSweepParameters));
  row.width = pixels("width");
  row.height = pixels("height");
  for (const NumberField& field : kNumbers) {
    row.*field.value = optional_number(field.name);
    if (field.positive && row.*field.value == 0.0) refuse(quoted(field.name) + " must be above 0");
  }
  row.flagged = number("flagged", 1);
  row.unanswered = number("unanswered", 1);
  if (!object.empty()) refuse(quoted(object.begin().key()) + " is not a field of a marker's row");
  return row;
}

bool dominates(const MarkerRow& a, const MarkerRow& b) {
  if (!a.ms || !a.rms) return false;
  if (!b.ms || !b.rms) return true;
  const auto clearly_better = [](const MarkerRow& x, const MarkerRow& y) {
    return *x.ms < kClearTime * *y.ms || *x.rms < kClearError * *y.rms ||
           x.worst_rms.value_or(0) < kClearError * y.worst_rms.value_or(0) ||
           x.flagged + x.unanswered < y.flagged + y.unanswered - kClearShare;
  };
  return clearly_better(a, b) && !clearly_better(b, a);
}

std::string or_none(const std::optional<double>& v, int decimals) { return v ? formatted("%.*f", decimals, *v) : "-"; }

std::string percent_or_none(const std::optional<double>& v) { return v ? percent(*v) : "-"; }

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
    b.on_front =
        std::ranges::none_of(rows, [&](const Row& a) { return a.setup.competes_with(b.setup) && dominates(a, b); });
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

Result<std::vector<MarkerRow>> read_marker_rows(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Status(StatusCode::not_found, path + ": cannot be read");
  std::vector<MarkerRow> rows;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    try {
      MarkerRow row = row_of(line);
      if (!rows.empty() && (row.width != rows[0].width || row.height != rows[0].height))
        refuse(
            formatted("pictures of %dx%d beside those of %dx%d", row.width, row.height, rows[0].width, rows[0].height));
      if (std::ranges::find(rows, row.what, &MarkerRow::what) != rows.end())
        refuse("a case of the name '" + row.what + "' came before");
      rows.push_back(std::move(row));
    } catch (const std::exception& error) {
      return Status(StatusCode::data_loss, path + ":" + std::to_string(number) + ": " + error.what());
    }
  }
  if (rows.empty())
    return Status(StatusCode::data_loss, path + ": no rows; tests/measure/measure_marker_trade prints them");
  return rows;
}

void mark_front(std::span<MarkerRow> rows) {
  for (MarkerRow& b : rows) {
    b.dominated_by.clear();
    for (const MarkerRow& a : rows)
      if (dominates(a, b)) b.dominated_by.push_back(a.what);
    b.on_front = b.ms && b.rms && b.dominated_by.empty();
  }
}

std::string marker_table_of(std::span<const MarkerRow> rows) {
  if (rows.empty()) return "";
  std::vector<TableLine> lines = {{"light from a marker", "ms", "first ms", "x memcpy", "RMS %", "light deg",
                                   "flagged %", "unanswered %", "front"}};
  for (const MarkerRow& r : rows)
    lines.push_back({r.what, or_none(r.ms, 2), or_none(r.ms_first, 1), or_none(r.memcpy_ratio, 1),
                     percent_or_none(r.rms) + " / " + percent_or_none(r.worst_rms),
                     or_none(r.direction_deg, 2) + " / " + or_none(r.worst_direction_deg, 2),
                     formatted("%.0f", 100 * r.flagged), formatted("%.0f", 100 * r.unanswered),
                     r.on_front ? "yes" : ""});
  std::string out = markdown_table(lines, 1);
  out +=
      formatted(
          "\nOne picture of %dx%d, 8 bits. ms: a frame in which the body is tracked; first: a frame in which it is "
          "searched everywhere.\n",
          rows[0].width, rows[0].height) +
      "One thread, from the camera's bytes to the descriptor; relative to memcpy of the same bytes. RMS: error of "
      "the irradiance over\n"
      "normals within 60 degrees of the camera, median / worst frame. light: direction error of the strongest light, "
      "median / worst of\n"
      "the frames that are not flagged. Front: time, RMS (median, worst), and share of flagged or unanswered "
      "frames.\n";
  for (const MarkerRow& b : rows) {
    if (b.parameter != "setting") continue;
    out += b.what + (b.dominated_by.empty()
                         ? ": on the measured front.\n"
                         : ": NOT on the measured front, dominated by " + joined(b.dominated_by) + ".\n");
  }
  return out;
}

nlohmann::ordered_json json_of(std::span<const MarkerRow> rows) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const MarkerRow& r : rows) {
    nlohmann::ordered_json& row = out.emplace_back(
        nlohmann::ordered_json{{"what", r.what}, {"knob", r.parameter}, {"width", r.width}, {"height", r.height}});
    for (const NumberField& field : kNumbers) row[field.name] = json_or_null(r.*field.value);
    row.update({{"flagged", r.flagged},
                {"unanswered", r.unanswered},
                {"on_front", r.on_front},
                {"beaten_by", r.dominated_by}});
  }
  return out;
}

}  // namespace lightwell::eval
