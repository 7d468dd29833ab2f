#include "pose/body_tracker.hpp"

#include <utility>

#include "pose/body_view.hpp"

namespace lightwell {

namespace {

Status wrong(const std::string& what) { return {StatusCode::invalid_argument, "body tracker: " + what}; }

/// The pose with the covariance of the noise that is independent between frames, without the focal length error.
UncertainPose without_focal(const BodyPose& pose, double focal_sigma) {
  UncertainPose out = pose.probe_body;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k < 6; ++k)
      out.covariance[i][k] -= focal_sigma * focal_sigma * pose.focal_jacobian[i] * pose.focal_jacobian[k];
  return out;
}

}  // namespace

Status BodyTrackerOptions::validate() const {
  if (const Status s = pose.validate(); !s.ok()) return s;
  if (const Status s = motion.validate(); !s.ok()) return s;
  if (!(search_decimate >= 1 && search_decimate <= 8))
    return wrong("search_decimate is " + std::to_string(search_decimate) + "; it must be 1 to 8");
  if (!(decimate == 0 || (decimate >= 1 && decimate <= 8)))
    return wrong("decimate is " + std::to_string(decimate) + "; it must be 0, or 1 to 8");
  if (lost_after < 1 || lost_after > 1000)
    return wrong("lost_after is " + std::to_string(lost_after) + "; it must be 1 to 1,000");
  return {};
}

struct BodyTracker::Impl {
  MarkerBody body;
  PosedLenses rig;
  BodyTrackerOptions options;
  std::vector<WorldTag> tags;
  TagDetector detector;
  BodyMotion motion;
  std::vector<bool> seen;  ///< By lens: whether its last picture showed the body.
  int misses = 0;          ///< Consecutive pictures without the body.

  /// Sets region and decimation of `out` from the prediction, or to the whole picture.
  void choose_region(const GreyPicture& picture, const PosedLens& lens, const std::optional<BodyPrediction>& expected,
                     BodyObservation& out) const;
};

void BodyTracker::Impl::choose_region(const GreyPicture& picture, const PosedLens& lens,
                                      const std::optional<BodyPrediction>& expected, BodyObservation& out) const {
  out.region = {0, 0, picture.width, picture.height};
  out.decimate = options.search_decimate;
  if (!expected) return;
  const std::optional<BodyView> view = view_of(lens, tags, expected->probe_body);
  if (!view) return;
  out.predicted = true;
  out.region = view->region;
  out.decimate = options.decimate > 0 ? options.decimate : decimation_for(view->cell_px);
}

BodyTracker::BodyTracker(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BodyTracker::BodyTracker(BodyTracker&&) noexcept = default;
BodyTracker& BodyTracker::operator=(BodyTracker&&) noexcept = default;
BodyTracker::~BodyTracker() = default;

Result<BodyTracker> BodyTracker::make(const MarkerBody& body, const RigParameters& rig,
                                      const BodyTrackerOptions& options) {
  if (const Status s = body.validate(); !s.ok()) return s;
  if (const Status s = rig.validate(); !s.ok()) return s;
  if (const Status s = options.validate(); !s.ok()) return s;
  Result<std::vector<WorldTag>> tags = tags_of(body);
  if (!tags) return tags.status();
  TagDetectorOptions detect;
  detect.families = {tags->front().family};
  detect.corners = options.corners;
  detect.linear = options.linear;
  Result<TagDetector> detector = TagDetector::make(detect);
  if (!detector) return detector.status();
  return BodyTracker(
      std::make_unique<Impl>(Impl{body, rig, options, std::move(*tags), std::move(*detector),
                                  BodyMotion(options.motion), std::vector<bool>(rig.lenses.size(), false)}));
}

void BodyTracker::set_decimation(double search_decimate, double decimate) {
  impl_->options.search_decimate = search_decimate;
  impl_->options.decimate = decimate;
}

void BodyTracker::reset() {
  impl_->motion.reset();
  impl_->seen.assign(impl_->seen.size(), false);
  impl_->misses = 0;
}

Result<BodyObservation> BodyTracker::track(const GreyPicture& picture, ProbeTime mid_exposure, int lens) {
  if (const Status s = picture.validate(); !s.ok()) return s;
  Impl& in = *impl_;
  if (!in.rig.has(lens))
    return wrong("there is no lens " + std::to_string(lens) + "; the rig has " + std::to_string(in.rig.lenses.size()));
  const auto l = static_cast<std::size_t>(lens);
  const PosedLens& through = in.rig.at(lens);
  if (picture.width != through.width || picture.height != through.height)
    return wrong("the picture has " + std::to_string(picture.width) + "x" + std::to_string(picture.height) +
                 " pixels, the calibration is for " + std::to_string(through.width) + "x" +
                 std::to_string(through.height));

  BodyObservation out;
  out.min_contrast = contrast_above_noise(picture);
  const std::optional<BodyPrediction> expected = in.motion.predict(mid_exposure);
  in.choose_region(picture, through, in.seen[l] ? expected : std::nullopt, out);
  Result<std::vector<TagDetection>> tags = in.detector.detect_in(picture, {out.region, out.decimate, out.min_contrast});
  if (!tags) return tags.status();
  out.tags = std::move(*tags);
  std::vector<TagObservation> seen;
  for (const TagDetection& tag : out.tags) seen.push_back({lens, tag});
  Result<BodyPose> pose = find_body_pose(in.rig, in.body, seen, expected, in.options.pose);
  in.seen[l] = pose.ok();
  if (pose) {
    in.misses = 0;
    in.motion.update(mid_exposure, without_focal(*pose, in.options.pose.focal_sigma), !pose->ambiguous);
    out.pose = std::move(*pose);
  } else {
    out.failure_reason = pose.status().message();
    if (++in.misses >= in.options.lost_after) in.motion.reset();
  }
  return out;
}

}  // namespace lightwell
