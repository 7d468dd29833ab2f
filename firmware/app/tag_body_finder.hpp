// What pose knows of a body's place, handed to the estimator that looks at its light.
#pragma once

#include <memory>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

#include "estimate/marker/body_finder.hpp"
#include "pose/body_tracker.hpp"

namespace lightwell {

/// By the body's AprilTags, followed from picture to picture. invalid_argument: a rig, a body or options that do not
/// validate.
[[nodiscard]] Result<std::unique_ptr<BodyFinder>> make_tag_body_finder(const RigParameters& rig, const MarkerBody& body,
                                                                       const BodyTrackerOptions& options = {});

}  // namespace lightwell
