#include "pose/tag_family.hpp"

#include <memory>
#include <string>

#include <apriltag/apriltag.h>

#include "pose/apriltag_family.hpp"

namespace lightwell {

std::string_view to_string(TagFamily family) { return family == TagFamily::tag36h11 ? "tag36h11" : "tagStandard41h12"; }

Result<TagFamily> parse_tag_family(std::string_view name) {
  for (const TagFamily family : {TagFamily::tag36h11, TagFamily::tagStandard41h12})
    if (name == to_string(family)) return family;
  return Status(StatusCode::invalid_argument,
                "'" + std::string(name) + "' is not a family of tags; known are tag36h11 and tagStandard41h12");
}

TagShape shape_of(TagFamily family) {
  if (family == TagFamily::tag36h11) return {10, 8, 587, true};
  return {9, 5, 2115, false};
}

Result<TagBitmap> tag_bitmap(TagFamily family, int id) {
  const TagShape shape = shape_of(family);
  if (id < 0 || id >= shape.tags)
    return Status(StatusCode::invalid_argument, std::string(to_string(family)) + " has no tag " + std::to_string(id) +
                                                    "; its last is " + std::to_string(shape.tags - 1));
  const ApriltagFamily held = make_apriltag_family(family);
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> image(apriltag_to_image(held.get(), id), image_u8_destroy);
  TagBitmap out;
  out.cells = image->width;
  for (int y = 0; y < image->height; ++y)
    for (int x = 0; x < image->width; ++x) out.dark.push_back(image->buf[y * image->stride + x] < 128);
  return out;
}

}  // namespace lightwell
