#include "tools/lightwell_calibrate/grey_image.hpp"

#include "imaging/image_file.hpp"

namespace lightwell::calibrate {

Result<GreyImage> read_grey(const std::string& path) {
  const Result<Image> image = read_image(path);
  if (!image) return image.status();
  if (image->format != PixelFormat::rgb8)
    return Status(StatusCode::invalid_argument, path + ": tags are detected in PNG and JPEG; this is a float image");
  GreyImage out{image->width, image->height, {}};
  out.data.reserve(image->data.size() / 3);
  const auto value = [&](std::size_t i) { return std::to_integer<int>(image->data[i]); };
  // Tags are grey, so the weights with the least noise of a Bayer sensor are used instead of luminance.
  for (std::size_t i = 0; i + 2 < image->data.size(); i += 3)
    out.data.push_back(static_cast<std::uint8_t>((value(i) + 2 * value(i + 1) + value(i + 2) + 2) / 4));
  return out;
}

}  // namespace lightwell::calibrate
