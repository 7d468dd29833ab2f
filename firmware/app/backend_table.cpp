#include "app/backend_table.hpp"

#include <array>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "app/daemon.hpp"
#include "app/log.hpp"
#include "camera/backends/sim/sim_backend.hpp"
#ifdef LIGHTWELL_HAVE_CAMERA_REPLAY
#include "camera/backends/replay/replay_backend.hpp"
#endif
#ifdef LIGHTWELL_HAVE_CAMERA_V4L2
#include "camera/backends/v4l2/v4l2_backend.hpp"
#endif
#ifdef LIGHTWELL_HAVE_CAMERA_DEPTHAI
#include "camera/backends/depthai/depthai_backend.hpp"
#endif
#ifdef LIGHTWELL_HAVE_CAMERA_LIBCAMERA
#include "camera/backends/libcamera/libcamera_backend.hpp"
#endif

namespace lightwell {
namespace {

/// A simulated camera that logs its progress, because rendering ahead can take a minute.
Result<std::unique_ptr<CameraBackend>> make_sim_with_progress(const CameraUri& uri, const CameraConfig& config) {
  Result<SimOptions> options = parse_sim_options(uri, config);
  if (!options) return options.status();
  auto camera = std::make_unique<SimBackend>(std::move(*options));
  camera->on_progress([next_quarter = 0](double share) mutable {
    if (stop_signal_pending()) {
      log_info("stopped by a signal while rendering ahead");
      std::_Exit(0);  // Nothing has been started that needs to be stopped.
    }
    const int quarter = static_cast<int>(4 * share);
    if (quarter < next_quarter) return;
    next_quarter = quarter + 1;
    log_info("camera: rendering ahead, " + std::to_string(static_cast<int>(100 * share)) + " % done");
  });
  return std::unique_ptr<CameraBackend>(std::move(camera));
}

}  // namespace

std::span<const BackendEntry> backend_table() {
  static constexpr std::array kTable = {
      BackendEntry{"sim", "sim:SCENE?sensor=rgb8&yaw_rate=30deg/s  a panorama seen through a simulated rig",
                   &make_sim_with_progress},
#ifdef LIGHTWELL_HAVE_CAMERA_REPLAY
      BackendEntry{"replay", "replay:PATH  a recording of lightwelld --record, or a directory of images",
                   &make_replay_backend},
#endif
#ifdef LIGHTWELL_HAVE_CAMERA_V4L2
      BackendEntry{"v4l2", "v4l2:/dev/video0?width=1280&height=960  a camera with a kernel driver, for example on USB",
                   &make_v4l2_backend},
#endif
#ifdef LIGHTWELL_HAVE_CAMERA_LIBCAMERA
      BackendEntry{"libcamera", "libcamera:ID[,ID]?format=nv12  one or two cameras as `cam --list` names them",
                   &make_libcamera_backend},
#endif
#ifdef LIGHTWELL_HAVE_CAMERA_DEPTHAI
      BackendEntry{"depthai", "depthai:MXID?socket=A&format=nv12  a Luxonis OAK camera", &make_depthai_backend},
#endif
  };
  return kTable;
}

Result<std::unique_ptr<CameraBackend>> make_backend(const CameraConfig& config) {
  const Result<CameraUri> uri = parse_camera_uri(config.uri);
  if (!uri) return uri.status();
  std::vector<std::string_view> known;
  std::string list;
  for (const BackendEntry& entry : backend_table()) {
    if (entry.scheme == uri->scheme) return entry.make(*uri, config);
    known.push_back(entry.scheme);
    list += (list.empty() ? "" : ", ") + std::string(entry.scheme);
  }
  const std::string nearest = nearest_name(uri->scheme, known);
  return Status(StatusCode::not_found, "camera '" + config.uri + "': no backend '" + uri->scheme + "' in this build" +
                                           (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)") +
                                           "; there are: " + list);
}

}  // namespace lightwell
