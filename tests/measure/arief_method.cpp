#include <optional>
#include <utility>

#include "bench/arief2012.hpp"
#include "measure/marker_methods.hpp"
#include "pose/body_tracker.hpp"

namespace lightwell::measure {

namespace {

using bench::AriefCase;
using bench::AriefLight;
using bench::AriefView;
using bench::kAriefThresholds;

/// Each frame on its own. Of the TracedFrame only the first lamp's direction and the group are read.
class AriefMethod final : public MarkerMethod {
 public:
  Status process(const TracedFrame& frame, const RigParameters& rig, const MarkerBody& body,
                 const Shot& shot) override {
    const LensParameters& lens = rig.lenses.front();
    const View& view = shot.frames.front().views().front();
    const GreyPicture picture = grey_.of(view);
    BodyTrackerOptions options;
    options.corners = CornerRefinement::edge_fit;
    options.linear = linear_of_grey(view.format, lens.photometry);
    Result<BodyTracker> tracker = BodyTracker::make(body, rig, options);
    if (!tracker) return tracker.status();
    const Result<BodyObservation> seen = tracker->track(picture, shot.frames.front().info.mid_exposure);
    if (!seen) return seen.status();

    AriefCase& one = cases_.emplace_back();
    one.truth = rotate(lens.pose_cv.rotation.inverse(), frame.lamps.front().direction);
    probe_lens_.push_back(lens.pose_cv.rotation);
    in_grid_.push_back(frame.group == "grid");
    if (!seen->pose) return {};
    const Pose lens_body = compose(inverse(lens.pose_cv), seen->pose->probe_body.pose);
    const std::optional<AriefView> ground = AriefView::make(picture, CameraModel(lens), body, lens_body);
    for (std::size_t k = 0; ground && k < kAriefThresholds; ++k)
      one.lights[k] = ground->light(bench::arief_threshold(k));
    return {};
  }

  std::vector<MarkerColumn> columns() const override {
    MarkerColumn each{"arief_each", {}, 0};
    for (std::size_t k = 0; k < cases_.size(); ++k)
      each.answers.push_back(
          answer(k, bench::arief_best_threshold({&cases_[k], 1}, &AriefLight::contour), &AriefLight::contour));
    return {column("arief", &AriefLight::contour), column("arief_line", &AriefLight::line), each};
  }

 private:
  [[nodiscard]] MarkerAnswer answer(std::size_t frame, std::size_t threshold, Vec3d AriefLight::*which) const {
    const AriefLight& light = cases_[frame].lights[threshold];
    return {light.known, false, rotate(probe_lens_[frame], light.*which)};
  }
  [[nodiscard]] MarkerColumn column(const char* name, Vec3d AriefLight::*which) const {
    std::vector<AriefCase> of_grid;
    for (std::size_t k = 0; k < cases_.size(); ++k)
      if (in_grid_[k]) of_grid.push_back(cases_[k]);
    const std::size_t threshold = bench::arief_best_threshold(of_grid, which);
    MarkerColumn out{name, {}, bench::arief_threshold(threshold)};
    for (std::size_t k = 0; k < cases_.size(); ++k) out.answers.push_back(answer(k, threshold, which));
    return out;
  }

  GreyView grey_;
  std::vector<AriefCase> cases_;
  std::vector<Quat> probe_lens_;
  std::vector<bool> in_grid_;
};

}  // namespace

std::unique_ptr<MarkerMethod> make_arief_method() { return std::make_unique<AriefMethod>(); }

}  // namespace lightwell::measure
