#include "tools/lightwell_eval/marker_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "tools/json_text.hpp"
#include "tools/lightwell_eval/table.hpp"

namespace lightwell::eval {
namespace {

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

[[noreturn]] void refuse(const std::string& what) { throw std::runtime_error(what); }

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
