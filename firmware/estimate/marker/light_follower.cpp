#include "estimate/marker/light_follower.hpp"

#include <algorithm>
#include <utility>

namespace lightwell::marker {
namespace {

/// Turn of the view, as seen from the body, after which lights are searched again: 5 degrees. The ground's samples are
/// then at other places relative to the edges of shadows, and the search may select another model.
constexpr double kViewAngle_rad = 0.087;
/// Shortest interval between two searches: one takes as long as ten to fifteen tracked frames.
constexpr double kMinInterval_s = 0.25;
/// Without motion: first and longest interval between two searches.
constexpr double kFirstInterval_s = 0.5, kMaxInterval_s = 8;

}  // namespace

void LightFollower::reset() {
  before_.reset();
  change_.clear();
  history_.clear();
  change_pending_ = false;
  change_searched_.reset();
}

bool LightFollower::search_is_due(const BodyView& view, Vec3d direction) const {
  const double passed_s = (view.time - searched_).seconds();
  if (change_pending_ && (!change_searched_ || (view.time - *change_searched_).seconds() >= kMinInterval_s))
    return true;
  return passed_s >= interval_s_ ||
         (passed_s >= kMinInterval_s && angle_between(direction, searched_from_) >= kViewAngle_rad);
}

LightingEstimate LightFollower::estimate(const BodyView& view, const Shading& shading, int max_lights) {
  if (before_ && view.time < before_->time) reset();
  const Vec3d direction = rotate(view.probe_body.inverse(), normalized(view.to_lens));
  // An ambiguous attitude tells nothing about changes.
  const bool changed = !view.ambiguous && change_.update(shading, view.probe_body, direction);
  if (changed || view.ambiguous) history_.clear();
  std::optional<LightingEstimate> previous;
  if (before_) {
    // Lights that stay where they are turn with the body, as the lens sees it.
    const Quat turn = (view.probe_body * before_->probe_body.inverse()).normalized();
    previous = changed || view.ambiguous ? before_->light : turned(before_->light, turn);
  }
  change_pending_ = change_pending_ || changed;
  const bool due = previous && search_is_due(view, direction);
  LightingEstimate out = estimate_lighting(shading, previous && !due ? &*previous : nullptr, max_lights);
  if (!out.tracked) {
    searched_ = view.time;
    searched_from_ = direction;
    interval_s_ = due && !change_pending_ ? std::min(2 * interval_s_, kMaxInterval_s) : kFirstInterval_s;
    if (change_pending_) change_searched_ = view.time;
    change_pending_ = false;
  }
  before_ = Before{out, view.time, view.probe_body};
  if (!view.ambiguous) history_.average(view.time, view.probe_body, out);
  return out;
}

}  // namespace lightwell::marker
