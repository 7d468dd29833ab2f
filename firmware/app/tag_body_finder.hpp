// Connects the body tracker of pose with the estimators that need the pose of a body.
#pragma once

#include <memory>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "estimate/frames/body_finder.hpp"
#include "pose/body_tracker.hpp"

namespace lightwell {

/// A BodyFinder that tracks the body by its AprilTags. invalid_argument: `rig`, `body` or `options` do not validate.
[[nodiscard]] Result<std::unique_ptr<BodyFinder>> make_tag_body_finder(const RigParameters& rig, const MarkerBody& body,
                                                                       const BodyTrackerOptions& options = {});

}  // namespace lightwell
