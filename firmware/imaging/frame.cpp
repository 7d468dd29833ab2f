#include "imaging/frame.hpp"

#include <string>

namespace lightwell {
namespace {

std::string size_and_format(const View& view) {
  return std::to_string(view.width) + "x" + std::to_string(view.height) + " pixels of " +
         std::string(to_string(view.format));
}

}  // namespace

Status check_view(const View& view) {
  const PixelLayout& layout = pixel_layout(view.format);
  if (!size_fits(view.format, view.width, view.height))
    return invalid_argument(size_and_format(view) + ": width and height must be positive multiples of " +
                            std::to_string(layout.unit_width) + " and " + std::to_string(layout.unit_height));
  if (const std::size_t row = packed_stride(view.format, view.width); view.stride < row)
    return invalid_argument("the stride of " + std::to_string(view.stride) + " bytes is too short for " +
                            size_and_format(view) + ", whose rows have " + std::to_string(row));
  if (const std::size_t bytes = picture_bytes(view.format, view.stride, view.height); view.data.size() < bytes)
    return invalid_argument("its data of " + std::to_string(view.data.size()) + " bytes are too few for " +
                            size_and_format(view) + ", which need " + std::to_string(bytes));
  return {};
}

}  // namespace lightwell
