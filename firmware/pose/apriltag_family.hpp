// Owning pointer to the AprilTag library's table of a tag family. Private to firmware/pose.
#pragma once

#include <memory>

#include <apriltag/apriltag.h>
#include <apriltag/common/image_u8.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>

#include "pose/tag_family.hpp"

namespace lightwell {

using ApriltagFamily = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

[[nodiscard]] inline ApriltagFamily make_apriltag_family(TagFamily family) {
  if (family == TagFamily::tagStandard41h12) return {tagStandard41h12_create(), tagStandard41h12_destroy};
  return {tag36h11_create(), tag36h11_destroy};
}

}  // namespace lightwell
