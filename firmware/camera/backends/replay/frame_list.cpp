#include "camera/backends/replay/frame_list.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "imaging/uri.hpp"

namespace lightwell::replay {
namespace {

const std::vector<std::string_view> kColumns = {"file",          "lens",         "exposure_s", "time_s",
                                                "bracket_index", "bracket_size", "gain",       "row_readout_s"};
const std::vector<std::string_view> kRequired = {"file", "exposure_s", "time_s"};

struct Row {
  std::string file;
  double lens = 0, exposure_s = 0, time_s = 0, bracket_index = 0, bracket_size = 1, gain = 1, row_readout_s = 0;
};

double* number(Row& row, std::string_view column) {
  if (column == "lens") return &row.lens;
  if (column == "exposure_s") return &row.exposure_s;
  if (column == "time_s") return &row.time_s;
  if (column == "bracket_index") return &row.bracket_index;
  if (column == "bracket_size") return &row.bracket_size;
  if (column == "gain") return &row.gain;
  if (column == "row_readout_s") return &row.row_readout_s;
  return nullptr;
}

bool is_index(double v, int end) { return v >= 0 && v < end && v == std::floor(v); }

class Parser {
 public:
  explicit Parser(std::string name) : name_(std::move(name)) {}

  [[nodiscard]] Status take_line(std::string_view line) {
    ++line_;
    if (trimmed(line).empty()) return {};
    if (columns_.empty()) return take_columns(line);
    Row row;
    if (Status s = read_row(line, row); !s.ok()) return s;
    return add(row);
  }

  [[nodiscard]] Result<std::vector<ListedFrame>> finish() {
    if (columns_.empty() || frames_.empty()) return bad("no frame is listed");
    if (Status s = check_last(); !s.ok()) return s;
    return std::move(frames_);
  }

 private:
  [[nodiscard]] Status bad(const std::string& what) const {
    return {StatusCode::invalid_argument, name_ + ":" + std::to_string(line_) + ": " + what};
  }

  [[nodiscard]] Status take_columns(std::string_view line) {
    for (const std::string_view column : comma_separated(line)) {
      if (std::ranges::find(kColumns, column) == kColumns.end()) {
        const std::string near = nearest_name(column, kColumns);
        return bad("no column '" + std::string(column) + "'" + (near.empty() ? "" : "; did you mean '" + near + "'?"));
      }
      if (std::ranges::find(columns_, column) != columns_.end())
        return bad("column '" + std::string(column) + "' is there twice");
      columns_.emplace_back(column);
    }
    for (const std::string_view column : kRequired)
      if (std::ranges::find(columns_, column) == columns_.end())
        return bad("no column '" + std::string(column) + "' in the first line");
    return {};
  }

  [[nodiscard]] Status read_row(std::string_view line, Row& row) const {
    const std::vector<std::string_view> fields = comma_separated(line);
    if (fields.size() != columns_.size())
      return bad(std::to_string(fields.size()) + " values for " + std::to_string(columns_.size()) + " columns");
    for (std::size_t i = 0; i < fields.size(); ++i) {
      double* const target = number(row, columns_[i]);
      if (target == nullptr) {
        row.file = fields[i];
        continue;
      }
      const std::optional<double> value = parse_number<double>(fields[i]);
      if (!value) return bad(columns_[i] + " '" + std::string(fields[i]) + "' is no number");
      *target = *value;
    }
    if (row.file.empty()) return bad("no file");
    if (!(row.exposure_s > 0)) return bad("exposure_s must be positive");
    if (!(row.gain > 0)) return bad("gain must be positive");
    if (!(row.row_readout_s >= 0 && row.row_readout_s <= 1)) return bad("row_readout_s must be 0 to 1");
    // The limit admits seconds since 1970, and nanoseconds fit into 64 bits.
    if (!(row.time_s >= 0 && row.time_s < 4e9)) return bad("time_s must be 0 to 4e9");
    if (!is_index(row.lens, kMaxLenses)) return bad("lens must be 0 or 1");
    if (!is_index(row.bracket_size - 1, kMaxBracket))
      return bad("bracket_size must be 1 to " + std::to_string(kMaxBracket));
    if (!is_index(row.bracket_index, static_cast<int>(row.bracket_size)))
      return bad("bracket_index must be 0 to bracket_size - 1");
    return {};
  }

  [[nodiscard]] Status add(const Row& row) {
    const bool same_frame = previous_ && previous_->time_s == row.time_s && previous_->exposure_s == row.exposure_s;
    if (same_frame) {
      if (previous_->bracket_index != row.bracket_index || previous_->gain != row.gain ||
          previous_->bracket_size != row.bracket_size || previous_->row_readout_s != row.row_readout_s)
        return bad("the lenses of one frame must have the same bracket, gain and row_readout_s");
    } else {
      if (previous_ && row.time_s <= previous_->time_s) return bad("time_s must grow");
      if (Status s = check_last(); !s.ok()) return s;
      frames_.push_back(frame_of(row));
    }
    auto& files = frames_.back().files;
    if (row.lens != static_cast<double>(files.size()))
      return bad("lens " + std::to_string(static_cast<int>(row.lens)) + " where lens " + std::to_string(files.size()) +
                 " of the frame was expected");
    files.push_back(row.file);
    previous_ = row;
    return {};
  }

  /// Checks that the completed last frame has the lenses and the bracket size of the first one.
  [[nodiscard]] Status check_last() const {
    if (frames_.empty()) return {};
    const ListedFrame& first = frames_.front();
    const ListedFrame& last = frames_.back();
    if (last.files.size() != first.files.size())
      return bad("the frame above has " + std::to_string(last.files.size()) + " lenses, the first one has " +
                 std::to_string(first.files.size()));
    if (last.info.bracket_size != first.info.bracket_size)
      return bad("the frame above has another bracket_size than the first one");
    return {};
  }

  [[nodiscard]] ListedFrame frame_of(const Row& row) const {
    ListedFrame frame;
    frame.info.sequence = frames_.size();
    frame.info.mid_exposure = {Duration::from_seconds(row.time_s).ns};
    frame.info.exposure_s = row.exposure_s;
    frame.info.gain = row.gain;
    frame.info.row_readout = Duration::from_seconds(row.row_readout_s);
    frame.info.bracket_index = static_cast<int>(row.bracket_index);
    frame.info.bracket_size = static_cast<int>(row.bracket_size);
    return frame;
  }

  std::string name_;
  int line_ = 0;
  std::vector<std::string> columns_;
  std::optional<Row> previous_;
  std::vector<ListedFrame> frames_;
};

}  // namespace

Result<std::vector<ListedFrame>> parse_frame_list(std::string_view text, const std::string& name) {
  Parser parser(name);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (Status s = parser.take_line(text.substr(0, end)); !s.ok()) return s;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parser.finish();
}

Result<std::vector<ListedFrame>> load_frame_list(const std::string& folder) {
  const std::string list = (std::filesystem::path(folder) / "frames.csv").string();
  const Result<std::string> text = read_text_file(list);
  if (!text && text.status().code() == StatusCode::not_found)
    return Status(StatusCode::not_found, list +
                                             ": not there; list the folder's pictures in it, a line each, with the "
                                             "columns file,exposure_s,time_s");
  if (!text) return text.status();
  return parse_frame_list(*text, list);
}

}  // namespace lightwell::replay
