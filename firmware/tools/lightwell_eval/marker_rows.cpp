#include "tools/lightwell_eval/marker_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "tools/json_text.hpp"
#include "tools/lightwell_eval/formatting.hpp"
#include "tools/lightwell_eval/front.hpp"

namespace lightwell::eval {
namespace {

constexpr std::array kSweepParameters = {MarkerSweepParameter::setting, MarkerSweepParameter::decimation,
                                         MarkerSweepParameter::search, MarkerSweepParameter::faces,
                                         MarkerSweepParameter::order};

/// Smallest significant difference of the share of flagged or unanswered frames.
constexpr double kClearShare = 0.01;

/// Typed access to the members of one line, a JSON object; keeps the first error.
class Reader {
 public:
  explicit Reader(const std::string& line) {
    using Event = nlohmann::ordered_json::parse_event_t;
    std::set<std::string> names;
    const auto find_repeated = [&](int, Event event, const nlohmann::ordered_json& value) {
      if (event == Event::key && !names.insert(value.get<std::string>()).second)
        set_error(formatted("\"%s\" is there twice", value.get<std::string>().c_str()));
      return true;
    };
    try {
      object_ = nlohmann::ordered_json::parse(line, find_repeated);
    } catch (const nlohmann::ordered_json::exception& e) {
      set_error(e.what());
    }
    if (!object_.is_object()) set_error("not a JSON object");
  }

  std::string string(const std::string& name) {
    const nlohmann::ordered_json value = take(name);
    const std::string out = value.is_string() ? value.get<std::string>() : "";
    if (out.empty()) set_error("\"" + name + "\" is not a string");
    return out;
  }
  std::optional<double> optional_number(const std::string& name) {
    const nlohmann::ordered_json value = take(name);
    if (value.is_null()) return std::nullopt;
    if (!value.is_number()) {
      set_error("\"" + name + "\" is not a number");
      return std::nullopt;
    }
    if (value.get<double>() < 0) set_error("\"" + name + "\" is negative");
    return value.get<double>();
  }
  /// For a value on a logarithmic axis.
  std::optional<double> optional_positive(const std::string& name) {
    const std::optional<double> v = optional_number(name);
    if (v && !(*v > 0)) set_error("\"" + name + "\" must be above 0");
    return v;
  }
  double number(const std::string& name, double most) {
    const std::optional<double> v = optional_number(name);
    if (!v || *v > most) set_error("\"" + name + "\" must be a number of at most " + formatted("%g", most));
    return v.value_or(0);
  }
  int whole(const std::string& name) {
    const double v = number(name, 1e5);
    if (v < 1 || v != std::floor(v)) set_error("\"" + name + "\" must be a whole number of pixels");
    return static_cast<int>(v);
  }
  void end() {
    if (!object_.empty()) set_error("\"" + object_.begin().key() + "\" is not a field of a marker's row");
  }
  void set_error(const std::string& what) {
    if (error.empty()) error = what;
  }

  std::string error;

 private:
  /// Removes and returns a member; null if it is missing, which is an error.
  nlohmann::ordered_json take(const std::string& name) {
    const auto found = object_.find(name);
    if (found == object_.end()) {
      set_error("it lacks \"" + name + "\"");
      return nullptr;
    }
    nlohmann::ordered_json value = std::move(*found);
    object_.erase(found);
    return value;
  }
  nlohmann::ordered_json object_;
};

MarkerRow row_of(Reader& from) {
  MarkerRow row;
  row.what = from.string("what");
  const std::string parameter = from.string("knob");
  const auto known = std::find_if(kSweepParameters.begin(), kSweepParameters.end(),
                                  [&](MarkerSweepParameter k) { return to_string(k) == parameter; });
  if (known == kSweepParameters.end())
    from.set_error("no knob '" + parameter + "'; there are setting, decimation, search, faces and order");
  else
    row.parameter = *known;
  row.width = from.whole("width");
  row.height = from.whole("height");
  row.ms = from.optional_positive("ms");
  row.ms_first = from.optional_number("ms_first");
  row.memcpy_ratio = from.optional_number("memcpy_ratio");
  row.rms = from.optional_positive("rms");
  row.worst_rms = from.optional_number("worst_rms");
  row.direction_deg = from.optional_number("direction_deg");
  row.worst_direction_deg = from.optional_number("worst_direction_deg");
  row.flagged = from.number("flagged", 1);
  row.unanswered = from.number("unanswered", 1);
  from.end();
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

std::string_view to_string(MarkerSweepParameter parameter) {
  switch (parameter) {
    case MarkerSweepParameter::setting:
      return "setting";
    case MarkerSweepParameter::decimation:
      return "decimation";
    case MarkerSweepParameter::search:
      return "search";
    case MarkerSweepParameter::faces:
      return "faces";
    case MarkerSweepParameter::order:
      return "order";
  }
  return "unknown";
}

Result<std::vector<MarkerRow>> read_marker_rows(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Status(StatusCode::not_found, path + ": cannot be read");
  std::vector<MarkerRow> rows;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    Reader reader(line);
    MarkerRow row;
    if (reader.error.empty()) row = row_of(reader);
    if (!rows.empty() && (row.width != rows[0].width || row.height != rows[0].height))
      reader.set_error(
          formatted("pictures of %dx%d beside those of %dx%d", row.width, row.height, rows[0].width, rows[0].height));
    if (std::any_of(rows.begin(), rows.end(), [&](const MarkerRow& r) { return r.what == row.what; }))
      reader.set_error("a case of the name '" + row.what + "' came before");
    if (!reader.error.empty())
      return Status(StatusCode::data_loss, path + ":" + std::to_string(number) + ": " + reader.error);
    rows.push_back(std::move(row));
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
    if (b.parameter != MarkerSweepParameter::setting) continue;
    out += b.what + (b.dominated_by.empty()
                         ? ": on the measured front.\n"
                         : ": NOT on the measured front, dominated by " + joined(b.dominated_by) + ".\n");
  }
  return out;
}

nlohmann::ordered_json json_of(std::span<const MarkerRow> rows) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const MarkerRow& r : rows)
    out.push_back({{"what", r.what},
                   {"knob", to_string(r.parameter)},
                   {"width", r.width},
                   {"height", r.height},
                   {"ms", json_or_null(r.ms)},
                   {"ms_first", json_or_null(r.ms_first)},
                   {"memcpy_ratio", json_or_null(r.memcpy_ratio)},
                   {"rms", json_or_null(r.rms)},
                   {"worst_rms", json_or_null(r.worst_rms)},
                   {"direction_deg", json_or_null(r.direction_deg)},
                   {"worst_direction_deg", json_or_null(r.worst_direction_deg)},
                   {"flagged", r.flagged},
                   {"unanswered", r.unanswered},
                   {"on_front", r.on_front},
                   {"beaten_by", r.dominated_by}});
  return out;
}

}  // namespace lightwell::eval
