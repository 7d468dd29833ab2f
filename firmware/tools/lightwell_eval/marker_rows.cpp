#include "tools/lightwell_eval/marker_rows.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <utility>
#include <variant>

#include <lightwell/json.hpp>

#include "tools/lightwell_eval/formatting.hpp"
#include "tools/lightwell_eval/front.hpp"

namespace lightwell::eval {
namespace {

constexpr std::array kSweepParameters = {MarkerSweepParameter::setting, MarkerSweepParameter::decimation,
                                         MarkerSweepParameter::search, MarkerSweepParameter::faces,
                                         MarkerSweepParameter::order};

/// Smallest significant difference of the share of flagged or unanswered frames.
constexpr double kClearShare = 0.01;

/// null, a number or a string.
using Value = std::variant<std::monostate, double, std::string>;

/// Parser for a JSON object (RFC 8259) whose values are numbers, strings and null; of the escapes only \", \\ and \/.
class FlatObject {
 public:
  explicit FlatObject(std::string_view line) : rest_(line) {}

  /// Parses the line; returns an error message or "".
  std::string read() {
    if (!take('{')) return "not a JSON object";
    if (!take('}')) {
      do {
        std::string name;
        if (!take_text(name)) return "a field's name should begin here: '" + near() + "'";
        if (!take(':')) return "no ':' after \"" + name + "\"";
        Value value;
        if (!take_value(value)) return "\"" + name + "\" is neither a number, a text nor null";
        if (!fields_.emplace(name, std::move(value)).second) return "\"" + name + "\" is there twice";
      } while (take(','));
      if (!take('}')) return "no ',' or '}' at '" + near() + "'";
    }
    skip_space();
    return rest_.empty() ? "" : "more than one object: '" + near() + "'";
  }

  /// Removes and returns a field.
  std::optional<Value> take_field(const std::string& name) {
    auto node = fields_.extract(name);
    if (node.empty()) return std::nullopt;
    return std::move(node.mapped());
  }
  [[nodiscard]] std::string first_left() const { return fields_.empty() ? "" : fields_.begin()->first; }

 private:
  [[nodiscard]] std::string near() const { return std::string(rest_.substr(0, 20)); }
  void skip_space() {
    const std::size_t n = rest_.find_first_not_of(" \t\r");
    rest_.remove_prefix(std::min(n, rest_.size()));
  }
  bool take(char c) {
    skip_space();
    if (!rest_.starts_with(c)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  bool take_text(std::string& out) {
    if (!take('"')) return false;
    while (!rest_.empty() && rest_.front() != '"') {
      if (rest_.front() == '\\') {
        if (rest_.size() < 2 || std::string_view("\"\\/").find(rest_[1]) == std::string_view::npos) return false;
        rest_.remove_prefix(1);
      }
      out += rest_.front();
      rest_.remove_prefix(1);
    }
    return take('"');
  }
  bool take_value(Value& out) {
    skip_space();
    if (rest_.starts_with("null")) return rest_.remove_prefix(4), true;
    if (rest_.starts_with('"')) return take_text(out.emplace<std::string>());
    // from_chars() accepts "inf" and "nan", which are not JSON.
    if (rest_.empty() || std::string_view("-0123456789").find(rest_.front()) == std::string_view::npos) return false;
    double& number = out.emplace<double>();
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), number);
    if (error != std::errc() || !std::isfinite(number)) return false;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return true;
  }

  std::string_view rest_;
  std::map<std::string, Value> fields_;
};

/// Typed access to the fields of one line; keeps the first error.
class Reader {
 public:
  explicit Reader(std::string_view line) : object_(line) { error = object_.read(); }

  std::string string(const std::string& name) {
    const std::optional<Value> v = find(name);
    const auto* text = v ? std::get_if<std::string>(&*v) : nullptr;
    if (v && (text == nullptr || text->empty())) set_error("\"" + name + "\" is not a string");
    return text == nullptr ? "" : *text;
  }
  std::optional<double> optional_number(const std::string& name) {
    const std::optional<Value> v = find(name);
    if (!v || std::holds_alternative<std::monostate>(*v)) return std::nullopt;
    const auto* number = std::get_if<double>(&*v);
    if (number == nullptr) {
      set_error("\"" + name + "\" is not a number");
      return std::nullopt;
    }
    if (*number < 0) set_error("\"" + name + "\" is negative");
    return *number;
  }
  /// For a value on a logarithmic axis.
  std::optional<double> optional_positive(const std::string& name) {
    const std::optional<double> v = optional_number(name);
    if (v && !(*v > 0)) set_error("\"" + name + "\" must be above 0");
    return v;
  }
  double number(const std::string& name, double most) {
    const std::optional<double> v = optional_number(name);
    if (!v || *v > most) set_error("\"" + name + "\" must be a number of at most " + text("%g", most));
    return v.value_or(0);
  }
  int whole(const std::string& name) {
    const double v = number(name, 1e5);
    if (v < 1 || v != std::floor(v)) set_error("\"" + name + "\" must be a whole number of pixels");
    return static_cast<int>(v);
  }
  void end() {
    if (const std::string left = object_.first_left(); !left.empty())
      set_error("\"" + left + "\" is not a field of a marker's row");
  }
  void set_error(const std::string& what) {
    if (error.empty()) error = what;
  }

  std::string error;

 private:
  std::optional<Value> find(const std::string& name) {
    std::optional<Value> v = object_.take_field(name);
    if (!v) set_error("it lacks \"" + name + "\"");
    return v;
  }
  FlatObject object_;
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

std::string or_none(const std::optional<double>& v, int decimals) { return v ? text("%.*f", decimals, *v) : "-"; }

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
          text("pictures of %dx%d beside those of %dx%d", row.width, row.height, rows[0].width, rows[0].height));
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
                     text("%.0f", 100 * r.flagged), text("%.0f", 100 * r.unanswered), r.on_front ? "yes" : ""});
  std::string out = markdown_table(lines, 1);
  out +=
      text(
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
    std::string by;
    for (const std::string& a : b.dominated_by) by += (by.empty() ? "" : ", ") + a;
    out += b.what +
           (by.empty() ? ": on the measured front.\n" : ": NOT on the measured front, dominated by " + by + ".\n");
  }
  return out;
}

std::string marker_json_of(std::span<const MarkerRow> rows) {
  std::string out = "[";
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const MarkerRow& r = rows[n];
    out += (n > 0 ? ",\n" : "\n") + std::string("{\"what\": ") + json_string(r.what) +
           ", \"knob\": " + json_string(to_string(r.parameter)) +
           text(", \"width\": %d, \"height\": %d, \"ms\": %s, \"ms_first\": %s, \"memcpy_ratio\": %s, ", r.width,
                r.height, number(r.ms).c_str(), number(r.ms_first).c_str(), number(r.memcpy_ratio).c_str()) +
           text("\"rms\": %s, \"worst_rms\": %s, \"direction_deg\": %s, \"worst_direction_deg\": %s, ",
                number(r.rms).c_str(), number(r.worst_rms).c_str(), number(r.direction_deg).c_str(),
                number(r.worst_direction_deg).c_str()) +
           text("\"flagged\": %s, \"unanswered\": %s, \"on_front\": %s, \"beaten_by\": [", number(r.flagged).c_str(),
                number(r.unanswered).c_str(), r.on_front ? "true" : "false");
    for (std::size_t i = 0; i < r.dominated_by.size(); ++i) out += (i > 0 ? ", " : "") + json_string(r.dominated_by[i]);
    out += "]}";
  }
  return out + "\n]";
}

}  // namespace lightwell::eval
