#include <filesystem>
#include <optional>
#include <utility>

#include <lightwell/calibration.hpp>
#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>

#include "camera/backends/replay/source.hpp"

namespace lightwell::replay {
namespace {

/// Number of frames read to determine info(): two of the longest brackets, and enough for a frame rate.
constexpr int kLookAhead = 32;

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

  [[nodiscard]] const CameraInfo& info() const override { return info_; }

  [[nodiscard]] bool next(StoredFrame& out) override {
    while (read(out))
      if (is_playable(out, info_)) return true;
    return false;
  }

  void rewind() override { reader_.rewind(); }

 private:
  /// Reads the next decodable frame; copies the pictures, because `decoded_` is reused.
  [[nodiscard]] bool read(StoredFrame& out) {
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
  CameraInfo info_;
};

}  // namespace

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

}  // namespace lightwell::replay
