#include "pose/grey_picture.hpp"

#include <string>

namespace lightwell {

namespace {
constexpr int kLargestSide = 16384;
}

Status GreyPicture::validate() const {
  const auto wrong = [](const std::string& what) { return Status(StatusCode::invalid_argument, "picture: " + what); };
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide)
    return wrong("it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels; a side must be 1 to " +
                 std::to_string(kLargestSide));
  const auto row = static_cast<std::size_t>(width);
  if (stride < row || stride > static_cast<std::size_t>(1) << 20)
    return wrong("stride is " + std::to_string(stride) + " bytes for rows of " + std::to_string(width));
  const std::size_t needed = stride * static_cast<std::size_t>(height - 1) + row;
  if (data.size() < needed)
    return wrong("it has " + std::to_string(data.size()) + " bytes and needs " + std::to_string(needed));
  return {};
}

}  // namespace lightwell
