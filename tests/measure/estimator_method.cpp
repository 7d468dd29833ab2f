#include <utility>

#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "measure/marker_methods.hpp"

namespace lightwell::measure {

namespace {

/// lightwelld's marker estimator; each frame is estimated on its own, as a first frame.
class EstimatorMethod final : public MarkerMethod {
 public:
  Status process(const TracedFrame&, const RigParameters& rig, const MarkerBody& body, const Shot& shot) override {
    Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, body);
    if (!finder) return finder.status();
    Result<std::unique_ptr<MarkerEstimator>> estimator = make_marker_estimator(rig, body, std::move(*finder), {});
    if (!estimator) return estimator.status();
    Descriptor out;
    MarkerAnswer answer;
    const Status s = (*estimator)->estimate(shot.frames, out);
    if (!s.ok() && s.code() != StatusCode::not_found) return s;
    answer.given = s.ok() && !out.lights.empty();
    answer.flagged = s.ok() && out.flags.has(Flag::unsure);
    if (answer.given) answer.direction = vec_cast<double>(out.lights.front().direction);
    column_.answers.push_back(answer);
    return {};
  }

  std::vector<MarkerColumn> columns() const override { return {column_}; }

 private:
  MarkerColumn column_{"ours", {}, 0};
};

}  // namespace

std::unique_ptr<MarkerMethod> make_estimator_method() { return std::make_unique<EstimatorMethod>(); }

}  // namespace lightwell::measure
