#include "app/backend_table.hpp"

#include <array>
#include <string>
#include <vector>

#include "camera/backends/replay/replay_backend.hpp"
#include "camera/backends/sim/sim_backend.hpp"

namespace lightwell {

std::span<const BackendEntry> backend_table() {
  static constexpr std::array kTable = {
      BackendEntry{"sim", "sim:SCENE?sensor=rgb8&turn=30deg/s  a panorama seen through a simulated rig",
                   &make_sim_backend},
      BackendEntry{"replay", "replay:PATH  a recording of lightwelld --record, or a directory of images",
                   &make_replay_backend},
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
