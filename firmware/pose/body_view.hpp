// What of a body's tags a lens will see: where in the picture, and how large. For this room's sources.
#pragma once

#include <optional>
#include <span>

#include "pose/body_pose.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

struct BodyView {
  PixelRegion
      region;  ///< Around all tags that may face the lens, by three standard deviations; may reach beyond the picture.
  double cell_px = 0;  ///< The shorter side of a cell of the smallest tag that is worth finding.
};

/// Nothing where no tag faces the lens and falls into its picture.
[[nodiscard]] std::optional<BodyView> view_of(const PosedLens& lens, std::span<const WorldTag> tags,
                                              const UncertainPose& probe_body);

/// By how much a picture may be made smaller so that tags with cells of `cell_px` are still found.
[[nodiscard]] double decimation_for(double cell_px);

}  // namespace lightwell
