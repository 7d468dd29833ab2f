#include <algorithm>
#include <filesystem>
#include <utility>

#include "camera/backends/replay/frame_list.hpp"
#include "camera/backends/replay/source.hpp"
#include "imaging/image_file.hpp"

namespace lightwell::replay {
namespace {

namespace fs = std::filesystem;

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
    if (Status s = read(first, frame); !s.ok()) return s;
    if (!is_playable(frame, info_))
      return {StatusCode::invalid_argument,
              folder_.string() + ": the pictures of the first frame differ in size or kind"};
    return {};
  }

  [[nodiscard]] const CameraInfo& info() const override { return info_; }

  [[nodiscard]] bool next(StoredFrame& out) override {
    while (at_ < frames_.size()) {
      const ListedFrame& listed = frames_[at_++];
      if (read(listed, out).ok() && is_playable(out, info_)) return true;
    }
    return false;
  }

  void rewind() override { at_ = 0; }

 private:
  [[nodiscard]] Status read(const ListedFrame& listed, StoredFrame& out) const {
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
  CameraInfo info_;
};

}  // namespace

Result<std::unique_ptr<Source>> open_folder(const std::string& path) {
  fs::path folder = fs::path(path).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // Trailing slash.
  Result<std::vector<ListedFrame>> frames = load_frame_list(folder.string());
  if (!frames) return frames.status();
  auto source = std::make_unique<FolderSource>(std::move(folder), std::move(*frames));
  if (Status s = source->learn(); !s.ok()) return s;
  return std::unique_ptr<Source>(std::move(source));
}

}  // namespace lightwell::replay
