#include "camera/backends/replay/source.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include <lightwell/calibration.hpp>
#include <lightwell/files.hpp>
#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>

#include "imaging/csv.hpp"
#include "imaging/image_file.hpp"

namespace lightwell::replay {
namespace {

/// Optional ones first.
const std::vector<std::string_view> kColumns = {"lens",          "bracket_index", "bracket_size", "gain",
                                                "row_readout_s", "file",          "exposure_s",   "time_s"};
constexpr std::size_t kRequired = 5;

struct Row {
  std::string file;
  double lens = 0, exposure_s = 0, time_s = 0, bracket_index = 0, bracket_size = 1, gain = 1, row_readout_s = 0;
};

bool is_index(double v, int end) { return v >= 0 && v < end && v == std::floor(v); }

Result<Row> read_row(const CsvRow& cells) {
  Row row;
  row.file = cells.cells.at("file");
  const std::pair<std::string_view, double*> numbers[] = {
      {"lens", &row.lens},
      {"exposure_s", &row.exposure_s},
      {"time_s", &row.time_s},
      {"bracket_index", &row.bracket_index},
      {"bracket_size", &row.bracket_size},
      {"gain", &row.gain},
      {"row_readout_s", &row.row_readout_s},
  };
  for (const auto& [column, number] : numbers)
    if (Status s = cells.read(column, *number); !s.ok()) return s;
  if (row.file.empty()) return cells.bad("no file");
  if (!(row.exposure_s > 0)) return cells.bad("exposure_s must be positive");
  if (!(row.gain > 0)) return cells.bad("gain must be positive");
  if (!(row.row_readout_s >= 0 && row.row_readout_s <= 1)) return cells.bad("row_readout_s must be 0 to 1");
  // The limit admits seconds since 1970, and nanoseconds fit into 64 bits.
  if (!(row.time_s >= 0 && row.time_s < 4e9)) return cells.bad("time_s must be 0 to 4e9");
  if (!is_index(row.lens, kMaxLenses)) return cells.bad("lens must be 0 or 1");
  if (!is_index(row.bracket_size - 1, kMaxBracket))
    return cells.bad("bracket_size must be 1 to " + std::to_string(kMaxBracket));
  if (!is_index(row.bracket_index, static_cast<int>(row.bracket_size)))
    return cells.bad("bracket_index must be 0 to bracket_size - 1");
  return row;
}

ListedFrame frame_of(const Row& row, std::size_t sequence) {
  ListedFrame frame;
  frame.info.sequence = sequence;
  frame.info.mid_exposure = {Duration::from_seconds(row.time_s).ns};
  frame.info.exposure_s = row.exposure_s;
  frame.info.gain = row.gain;
  frame.info.row_readout = Duration::from_seconds(row.row_readout_s);
  frame.info.bracket_index = static_cast<int>(row.bracket_index);
  frame.info.bracket_size = static_cast<int>(row.bracket_size);
  return frame;
}

/// Checks that the completed last frame has the lenses and the bracket size of the first one.
Status check_last(const CsvRow& at, const std::vector<ListedFrame>& frames) {
  if (frames.empty()) return {};
  const ListedFrame& first = frames.front();
  const ListedFrame& last = frames.back();
  if (last.files.size() != first.files.size())
    return at.bad("the frame above has " + std::to_string(last.files.size()) + " lenses, the first one has " +
                  std::to_string(first.files.size()));
  if (last.info.bracket_size != first.info.bracket_size)
    return at.bad("the frame above has another bracket_size than the first one");
  return {};
}

namespace fs = std::filesystem;

/// Frames of a recording that are read to determine info(): two of the longest brackets, enough for a frame rate.
constexpr int kLookAhead = 32;

bool positive(double v) { return v > 0 && std::isfinite(v); }

/// Whether a frame is as `info` declares and valid for an estimator: sizes, aligned rows, exposure and gain.
bool is_playable(const StoredFrame& frame, const CameraInfo& info) {
  if (frame.view_count != static_cast<std::size_t>(info.lenses)) return false;
  if (!positive(frame.info.exposure_s) || !positive(frame.info.gain)) return false;
  // An exposure above an hour, or a row readout above a second, indicates damage, and could exceed Duration's range.
  if (frame.info.exposure_s > 3600 || frame.info.row_readout.ns < 0 ||
      frame.info.row_readout > Duration::from_seconds(1))
    return false;
  if (frame.info.mid_exposure.ns < 0 || frame.info.mid_exposure.ns > (std::int64_t{1} << 62)) return false;
  for (std::size_t i = 0; i < frame.view_count; ++i) {
    const View& view = frame.views[i];
    if (view.lens < 0 || view.lens >= kMaxLenses || (i > 0 && view.lens <= frame.views[i - 1].lens)) return false;
    if (view.width != info.width || view.height != info.height || view.format != info.format) return false;
    if (view.stride % pixel_layout(view.format).sample_bytes != 0 || !check_view(view).ok()) return false;
  }
  return true;
}

class FolderSource final : public Source {
 public:
  FolderSource(fs::path folder, std::vector<ListedFrame> frames)
      : folder_(std::move(folder)), frames_(std::move(frames)) {}

  /// Derives info() from the frame list and the first frame, so that an unreadable folder is refused.
  [[nodiscard]] Status learn() {
    const ListedFrame& first = frames_.front();
    const Result<Image> image = read_image((folder_ / first.files[0]).string());
    if (!image) return image.status();
    info_.name = "replay:" + folder_.filename().string();
    info_.width = image->width;
    info_.height = image->height;
    info_.format = image->format;
    info_.lenses = static_cast<int>(first.files.size());
    info_.exposure_s.assign(static_cast<std::size_t>(first.info.bracket_size), first.info.exposure_s);
    // In reverse order, so that the declared exposures are those of the first bracket.
    for (auto frame = frames_.rbegin(); frame != frames_.rend(); ++frame)
      info_.exposure_s[static_cast<std::size_t>(frame->info.bracket_index)] = frame->info.exposure_s;
    const Duration length = frames_.back().info.mid_exposure - first.info.mid_exposure;
    if (length.ns > 0) info_.frame_rate = static_cast<double>(frames_.size() - 1) / length.seconds();

    const fs::path calibration = folder_ / "calibration.textproto";
    std::error_code error;
    if (fs::exists(calibration, error)) {
      if (Status s = load_calibration(calibration.string()).assign_to(info_.calibration); !s.ok()) return s;
    }
    StoredFrame frame;
    if (Status s = read_listed(first, frame); !s.ok()) return s;
    if (!is_playable(frame, info_))
      return invalid_argument(folder_.string() + ": the pictures of the first frame differ in size or kind");
    return {};
  }

  void rewind() override { at_ = 0; }

 private:
  [[nodiscard]] bool read(StoredFrame& out) override {
    while (at_ < frames_.size())
      if (read_listed(frames_[at_++], out).ok()) return true;
    return false;
  }

  [[nodiscard]] Status read_listed(const ListedFrame& listed, StoredFrame& out) const {
    out.info = listed.info;
    out.view_count = 0;
    for (const std::string& file : listed.files) {
      Result<Image> image = read_image((folder_ / file).string());
      if (!image) return image.status();
      const std::size_t lens = out.view_count++;
      out.pictures[lens] = std::move(image->data);
      out.views[lens] = {static_cast<int>(lens), image->format,   image->width,
                         image->height,          image->stride(), out.pictures[lens]};
    }
    return {};
  }

  fs::path folder_;
  std::vector<ListedFrame> frames_;
  std::size_t at_ = 0;
};

class RecordingSource final : public Source {
 public:
  explicit RecordingSource(RecordReader reader) : reader_(std::move(reader)) {}

  /// Derives info() from the first frames.
  [[nodiscard]] Status learn(const std::string& path) {
    info_.name = "replay:" + std::filesystem::path(path).filename().string();
    if (const std::optional<std::string>& bytes = reader_.header().calibration) {
      Result<RigParameters> rig = decode_calibration(*bytes);
      if (!rig) return {StatusCode::data_loss, path + ": the calibration in it is invalid: " + rig.status().message()};
      info_.calibration = std::move(*rig);
    }
    StoredFrame frame;
    std::optional<FrameInfo> first, last;
    for (int i = 0; i < kLookAhead && read(frame); ++i) {
      if (!first) declare(frame);
      if (!is_playable(frame, info_)) continue;
      const FrameInfo& now = frame.info;
      // Times and numbers restart where a recording was appended to: the frame rate is that of the first part.
      if (last && (now.sequence <= last->sequence || now.mid_exposure <= last->mid_exposure)) break;
      if (!first) first = now;
      if (now.bracket_size == first->bracket_size)
        info_.exposure_s[static_cast<std::size_t>(now.bracket_index)] = now.exposure_s;
      last = now;
    }
    if (!first) return {StatusCode::data_loss, path + ": it contains no playable frame; record again"};
    if (last->sequence > first->sequence)
      info_.frame_rate =
          static_cast<double>(last->sequence - first->sequence) / (last->mid_exposure - first->mid_exposure).seconds();
    rewind();
    return {};
  }

  void rewind() override { reader_.rewind(); }

 private:
  /// Copies the pictures, because `decoded_` is reused.
  [[nodiscard]] bool read(StoredFrame& out) override {
    do {
      if (!reader_.next(record_)) return false;
    } while (!decoded_.decode(record_.payload).ok());
    const FrameRecord& frame = decoded_.frame;
    out.info.sequence = frame.sequence;
    out.info.mid_exposure = frame.mid_exposure;
    out.info.exposure_s = frame.exposure_s;
    out.info.gain = frame.gain;
    out.info.row_readout = frame.row_readout;
    out.info.bracket_index = frame.bracket_index;
    out.info.bracket_size = frame.bracket_size;
    out.view_count = 0;
    for (const RecordedView& view : frame.views) {
      if (out.view_count == out.views.size()) break;
      std::vector<std::byte>& picture = out.pictures[out.view_count];
      picture.assign(view.data.begin(), view.data.end());
      out.views[out.view_count++] = {view.lens, view.format, view.width, view.height, view.stride, picture};
    }
    return true;
  }

  void declare(const StoredFrame& frame) {
    const View& view = frame.views[0];
    info_.width = view.width;
    info_.height = view.height;
    info_.format = view.format;
    info_.lenses = static_cast<int>(frame.view_count);
    info_.exposure_s.assign(static_cast<std::size_t>(frame.info.bracket_size), frame.info.exposure_s);
  }

  RecordReader reader_;
  Record record_;
  DecodedFrame decoded_;
};

Result<std::unique_ptr<Source>> open_folder(const std::string& path) {
  fs::path folder = fs::path(path).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // Trailing slash.
  Result<std::vector<ListedFrame>> frames = load_frame_list(folder.string());
  if (!frames) return frames.status();
  auto source = std::make_unique<FolderSource>(std::move(folder), std::move(*frames));
  if (Status s = source->learn(); !s.ok()) return s;
  return std::unique_ptr<Source>(std::move(source));
}

Result<std::unique_ptr<Source>> open_recording(const std::string& path) {
  Result<RecordReader> reader = RecordReader::open(path);
  if (!reader) return reader.status();
  if (reader->header().kind != RecordingKind::frames)
    return invalid_argument(path +
                            ": a recording of descriptors, not of frames; record the camera's frames "
                            "with the probe's record_path");
  auto source = std::make_unique<RecordingSource>(std::move(*reader));
  if (Status s = source->learn(path); !s.ok()) return s;
  return std::unique_ptr<Source>(std::move(source));
}

}  // namespace

Result<std::vector<ListedFrame>> parse_frame_list(std::string_view text, const std::string& name) {
  const Result<std::vector<CsvRow>> rows = parse_csv(text, name, kColumns, kRequired);
  if (!rows) return rows.status();
  if (rows->empty()) return invalid_argument(name + ": no frame is listed");
  std::vector<ListedFrame> frames;
  std::optional<Row> previous;
  for (const CsvRow& cells : *rows) {
    const Result<Row> row = read_row(cells);
    if (!row) return row.status();
    if (previous && previous->time_s == row->time_s && previous->exposure_s == row->exposure_s) {
      if (previous->bracket_index != row->bracket_index || previous->gain != row->gain ||
          previous->bracket_size != row->bracket_size || previous->row_readout_s != row->row_readout_s)
        return cells.bad("the lenses of one frame must have the same bracket, gain and row_readout_s");
    } else {
      if (previous && row->time_s <= previous->time_s) return cells.bad("time_s must grow");
      if (Status s = check_last(cells, frames); !s.ok()) return s;
      frames.push_back(frame_of(*row, frames.size()));
    }
    std::vector<std::string>& files = frames.back().files;
    if (row->lens != static_cast<double>(files.size()))
      return cells.bad("lens " + std::to_string(static_cast<int>(row->lens)) + " where lens " +
                       std::to_string(files.size()) + " of the frame was expected");
    files.push_back(row->file);
    previous = *row;
  }
  if (Status s = check_last(rows->back(), frames); !s.ok()) return s;
  return frames;
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

bool Source::next(StoredFrame& out) {
  while (read(out))
    if (is_playable(out, info_)) return true;
  return false;
}

Result<std::unique_ptr<Source>> open_source(const std::string& path) {
  std::error_code error;
  if (path.empty()) return invalid_argument("replay: no path; write replay:room.lwrec");
  if (std::filesystem::is_directory(path, error)) return open_folder(path);
  return open_recording(path);
}

}  // namespace lightwell::replay
