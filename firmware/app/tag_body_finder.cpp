#include "app/tag_body_finder.hpp"

#include <optional>
#include <string>
#include <utility>

#include "pose/grey_view.hpp"

namespace lightwell {
namespace {

class TagBodyFinder final : public BodyFinder {
 public:
  TagBodyFinder(RigParameters rig, MarkerBody body, BodyTrackerOptions options, BodyTracker tracker)
      : rig_(std::move(rig)), body_(std::move(body)), options_(std::move(options)), tracker_(std::move(tracker)) {}

  void set_decimation(const FinderDecimation& decimation) override {
    options_.search_decimate = decimation.full_search;
    options_.decimate = decimation.tracked;
    tracker_.set_decimation(decimation.full_search, decimation.tracked);
  }

  Result<std::optional<DetectedBody>> find(const View& view, const FrameInfo& info) override {
    if (view.lens < 0 || static_cast<std::size_t>(view.lens) >= rig_.lenses.size())
      return Status(StatusCode::invalid_argument,
                    "frame: lens " + std::to_string(view.lens) + " is not in the calibration");
    if (const Status s = adapt_to_format(view); !s.ok()) return s;
    const Result<BodyObservation> observation = tracker_.track(grey_.of(view), info.mid_exposure, view.lens);
    if (!observation) return observation.status();
    const std::optional<BodyPose>& pose = observation->pose;
    if (!pose) return std::optional<DetectedBody>();
    return std::optional<DetectedBody>({pose->probe_body, pose->used, pose->ambiguous, pose->blur_px});
  }

 private:
  /// Recreates the tracker with the linearisation of the view's pixel format when the format changes.
  Status adapt_to_format(const View& view) {
    if (format_ == view.format) return {};
    options_.linear = linear_of_grey(view.format, rig_.lenses[static_cast<std::size_t>(view.lens)].photometry);
    const Status made = BodyTracker::make(body_, rig_, options_).assign_to(tracker_);
    if (made.ok()) format_ = view.format;
    return made;
  }

  RigParameters rig_;
  MarkerBody body_;
  BodyTrackerOptions options_;
  BodyTracker tracker_;
  GreyView grey_;
  std::optional<PixelFormat> format_;
};

}  // namespace

Result<std::unique_ptr<BodyFinder>> make_tag_body_finder(const RigParameters& rig, const MarkerBody& body,
                                                         const BodyTrackerOptions& options) {
  Result<BodyTracker> tracker = BodyTracker::make(body, rig, options);
  if (!tracker) return tracker.status();
  return std::unique_ptr<BodyFinder>(std::make_unique<TagBodyFinder>(rig, body, options, std::move(*tracker)));
}

}  // namespace lightwell
