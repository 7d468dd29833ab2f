#include "tools/lens_image.hpp"

#include <lightwell/text.hpp>

namespace lightwell {

Result<Image> read_lens_image(const std::string& path, const RigParameters& rig, int lens) {
  if (lens < 0 || static_cast<std::size_t>(lens) >= rig.lenses.size())
    return invalid_argument(
        path + formatted(": lens %d is not in the calibration, which has %zu (numbered from 0); see --lens", lens,
                         rig.lenses.size()));
  Result<Image> image = read_image(path);
  if (!image) return image;
  const LensParameters& expected = rig.lenses[static_cast<std::size_t>(lens)];
  if (image->width != expected.width || image->height != expected.height)
    return invalid_argument(path + formatted(": it has %dx%d pixels, the calibration of lens %d is for %dx%d",
                                             image->width, image->height, lens, expected.width, expected.height));
  return image;
}

View view_of(const Image& image, int lens) {
  return {lens, image.format, image.width, image.height, image.stride(), image.data};
}

}  // namespace lightwell
