#include "app/estimator_table.hpp"

#include <array>
#include <string>
#include <utility>

#include <lightwell/descriptor.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#ifdef LIGHTWELL_HAVE_MARKER
#include "app/log.hpp"
#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#endif

namespace lightwell {
namespace {

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
    return Status(StatusCode::invalid_argument,
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
  // With a mounting the up direction is known, and thus the face on which the body stands.
  if (mounting) options.sampler.up = rotate(mounting->pose.rotation.inverse(), Vec3d{0, 1, 0});
  Result<std::unique_ptr<MarkerEstimator>> marker = make_marker_estimator(rig, *body, std::move(*finder), options);
  if (!marker) return marker.status();
  log_info("marker: looking for " + body->name);
  return std::unique_ptr<Estimator>(std::move(*marker));
}
#endif

}  // namespace

std::span<const EstimatorEntry> estimator_table() {
  static constexpr std::array kTable = {
      EstimatorEntry{EstimatorKind::panorama, "all that the camera sees around it", &make_panorama},
#ifdef LIGHTWELL_HAVE_MARKER
      EstimatorEntry{EstimatorKind::marker, "a body with tags in the picture", &make_marker},
#endif
  };
  return kTable;
}

Result<std::unique_ptr<Estimator>> make_estimator(const Config& config, const RigParameters& rig,
                                                  const std::optional<UncertainPose>& mounting) {
  for (const EstimatorEntry& entry : estimator_table())
    if (entry.kind == config.estimator_kind) return entry.make(config, rig, mounting);
  const std::string name(to_string(config.estimator_kind));
  return Status(StatusCode::failed_precondition,
                name + ": this lightwelld was built without the " + name +
                    " estimator; build it again with LIGHTWELL_WITHOUT empty, or leave `" + name + "` out");
}

}  // namespace lightwell
