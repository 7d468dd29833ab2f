#include "camera/backends/replay/source.hpp"

#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include <lightwell/calibration.hpp>
#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>

#include "camera/backends/replay/frame_list.hpp"
#include "imaging/image_file.hpp"

namespace lightwell::replay {
namespace {

namespace fs = std::filesystem;

/// Number of frames of a recording that are read to determine info(): two of the longest brackets, and enough for a
/// frame rate.
constexpr int kLookAhead = 32;

bool positive(double v) { return v > 0 && std::isfinite(v); }

/// Whether a frame is as `info` declares and valid for an estimator: sizes that fit the format, aligned rows, positive
/// exposure and gain.
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
      Result<RigParameters> rig = load_calibration(calibration.string());
      if (!rig) return rig.status();
      info_.calibration = std::move(*rig);
    }
    StoredFrame frame;
    if (Status s = read_listed(first, frame); !s.ok()) return s;
    if (!is_playable(frame, info_))
      return {StatusCode::invalid_argument,
              folder_.string() + ": the pictures of the first frame differ in size or kind"};
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
    return Status(StatusCode::invalid_argument,
                  path +
                      ": a recording of descriptors, not of frames; record the camera's frames "
                      "with the probe's record_path");
  auto source = std::make_unique<RecordingSource>(std::move(*reader));
  if (Status s = source->learn(path); !s.ok()) return s;
  return std::unique_ptr<Source>(std::move(source));
}

}  // namespace

bool Source::next(StoredFrame& out) {
  while (read(out))
    if (is_playable(out, info_)) return true;
  return false;
}

Result<std::unique_ptr<Source>> open_source(const std::string& path) {
  std::error_code error;
  if (path.empty()) return Status(StatusCode::invalid_argument, "replay: no path; write replay:room.lwrec");
  if (std::filesystem::is_directory(path, error)) return open_folder(path);
  return open_recording(path);
}

}  // namespace lightwell::replay
