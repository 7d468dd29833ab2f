#include "app/component_tables.hpp"

#include <array>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/text.hpp>

#include "app/daemon.hpp"
#include "camera/backends/sim/sim_backend.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
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
#ifdef LIGHTWELL_HAVE_MARKER
#include "estimate/marker/marker_estimator.hpp"
#endif
#ifdef LIGHTWELL_HAVE_TAG_BODY_FINDER
#include "app/tag_body_finder.hpp"
#include "estimate/specular/specular_estimator.hpp"
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

Result<std::unique_ptr<Estimator>> make_panorama(const Config& config, const RigParameters& rig,
                                                 const std::optional<UncertainPose>& /*mounting*/) {
  PanoramaOptions options;
  options.config = config.estimator;
  options.probe_id = fnv1a_32(config.probe_name);
  options.grey_patch = config.grey_patch;
  return make_panorama_estimator(rig, options);
}

#ifdef LIGHTWELL_HAVE_MARKER
/// Requires config.marker.
Result<std::unique_ptr<Estimator>> make_marker(const Config& config, const RigParameters& rig,
                                               const std::optional<UncertainPose>& mounting) {
  // The governor keeps a budget by choosing a cheaper setting.
  if (config.budget_ms > 0 && settings_of(EstimatorKind::marker).size() < 2)
    return invalid_argument(
        "budget_ms: the marker estimator has no cheaper setting to keep a budget with; leave budget_ms "
        "(--budget-ms) out, and set estimator.marker.decimation (2 saves a tenth of the time) or "
        "estimator.marker.max_faces");
  const Result<MarkerBody> body = load_marker_body(config.marker->body_file);
  if (!body) return body.status();
  Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, *body);
  if (!finder) return finder.status();
  MarkerOptions options;
  options.config = config.estimator;
  options.probe_id = fnv1a_32(config.probe_name);
  // With a mounting the up direction is known; without one, the face on which the body stands is inferred from the
  // image.
  if (mounting) options.sampler.up = rotate(mounting->pose.rotation.inverse(), Vec3d{0, 1, 0});
  Result<std::unique_ptr<MarkerEstimator>> marker = make_marker_estimator(rig, *body, std::move(*finder), options);
  if (!marker) return marker.status();
  log_info("marker: looking for " + body->name);
  return std::unique_ptr<Estimator>(std::move(*marker));
}
#endif

#ifdef LIGHTWELL_HAVE_TAG_BODY_FINDER
/// Requires config.plane.
Result<std::unique_ptr<Estimator>> make_specular(const Config& config, const RigParameters& rig,
                                                 const std::optional<UncertainPose>& /*mounting*/) {
  if (config.budget_ms > 0 && settings_of(EstimatorKind::specular).size() < 2)
    return invalid_argument(
        "budget_ms: the specular estimator has no cheaper setting to keep a budget with; leave budget_ms "
        "(--budget-ms) out, and lower camera.frame_rate");
  const Result<GlossyPlane> plane = load_glossy_plane(config.plane->plane_file);
  if (!plane) return plane.status();
  Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, plane->body());
  if (!finder) return finder.status();
  SpecularOptions options;
  options.config = config.estimator;
  options.probe_id = fnv1a_32(config.probe_name);
  // A reader that still holds the capture of a former run recognises another number.
  std::random_device random;
  options.plane_capture = std::uniform_int_distribution<std::uint32_t>(1)(random);
  Result<std::unique_ptr<SpecularEstimator>> specular =
      make_specular_estimator(rig, *plane, std::move(*finder), options);
  if (!specular) return specular.status();
  log_info("specular: looking for " + plane->name);
  return std::unique_ptr<Estimator>(std::move(*specular));
}
#endif

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
  for (const BackendEntry& entry : backend_table()) {
    if (entry.scheme == uri->scheme) return entry.make(*uri, config);
    known.push_back(entry.scheme);
  }
  const std::string nearest = nearest_name(uri->scheme, known);
  return Status(StatusCode::not_found, "camera '" + config.uri + "': no backend '" + uri->scheme + "' in this build" +
                                           (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)") +
                                           "; there are: " + joined(known));
}

std::span<const EstimatorEntry> estimator_table() {
  static constexpr std::array kTable = {
      EstimatorEntry{EstimatorKind::panorama, "all that the camera sees around it", &make_panorama},
#ifdef LIGHTWELL_HAVE_MARKER
      EstimatorEntry{EstimatorKind::marker, "a body with tags in the picture", &make_marker},
#endif
#ifdef LIGHTWELL_HAVE_TAG_BODY_FINDER
      EstimatorEntry{EstimatorKind::specular, "a glossy plane that the camera moves around", &make_specular},
#endif
  };
  return kTable;
}

Result<std::unique_ptr<Estimator>> make_estimator(const Config& config, const RigParameters& rig,
                                                  const std::optional<UncertainPose>& mounting) {
  if (config.max_bound > 0 && settings_of(config.estimator_kind).size() < 2)
    return invalid_argument("max_bound: the " + std::string(to_string(config.estimator_kind)) +
                            " estimator has no settings to choose from; leave max_bound (--max-bound) out");
  for (const EstimatorEntry& entry : estimator_table())
    if (entry.kind == config.estimator_kind) return entry.make(config, rig, mounting);
  const std::string name(to_string(config.estimator_kind));
  return Status(StatusCode::failed_precondition,
                name + ": this lightwelld was built without the " + name +
                    " estimator; build it again with LIGHTWELL_WITHOUT empty, or leave `" + name + "` out");
}

}  // namespace lightwell
