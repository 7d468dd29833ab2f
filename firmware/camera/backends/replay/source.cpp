#include "camera/backends/replay/source.hpp"

#include <cmath>
#include <filesystem>

namespace lightwell::replay {
namespace {

bool positive(double v) { return v > 0 && std::isfinite(v); }

}  // namespace

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

Result<std::unique_ptr<Source>> open_source(const std::string& path) {
  std::error_code error;
  if (path.empty()) return Status(StatusCode::invalid_argument, "replay: no path; write replay:room.lwrec");
  if (std::filesystem::is_directory(path, error)) return open_folder(path);
  return open_recording(path);
}

}  // namespace lightwell::replay
