// Predicts which of a body's tags a lens sees: the region of the picture and the size of the cells. Private to
// firmware/pose.
#pragma once

#include <optional>
#include <span>

#include "pose/body_pose.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

struct BodyView {
  /// Contains all tags that may face the lens, with a margin of three standard deviations; clipped to the picture.
  PixelRegion region;
  double cell_px = 0;  ///< Shorter side of a cell of the smallest tag that needs to be found.
};

/// nullopt where no tag both faces the lens and lies in its picture. `tags` are in the body frame.
[[nodiscard]] std::optional<BodyView> view_of(const PosedLens& lens, std::span<const WorldTag> tags,
                                              const UncertainPose& probe_body);

/// The largest decimation at which AprilTag still finds tags with cells of `cell_px`.
[[nodiscard]] double decimation_for(double cell_px);

}  // namespace lightwell
