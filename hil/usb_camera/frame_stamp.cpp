#include "usb_camera/frame_stamp.hpp"

#include <array>
#include <cstddef>

namespace lightwell::usb_camera {

namespace {

constexpr std::size_t kDigits = 16;

}  // namespace

Picture stamped(const Picture& picture, Encoding encoding, std::uint64_t number) {
  auto out = std::make_shared<std::vector<std::byte>>(*picture);
  if (encoding == Encoding::mjpeg) {
    // After the two bytes of the start marker, the comment: marker, length including itself, number.
    std::array<std::byte, 12> comment = {std::byte{0xFF}, std::byte{0xFE}, std::byte{0}, std::byte{10}};
    for (std::size_t i = 0; i < 8; ++i) comment[4 + i] = static_cast<std::byte>(number >> (8 * i));
    if (out->size() >= 2) out->insert(out->begin() + 2, comment.begin(), comment.end());
    return out;
  }
  const std::size_t step = encoding == Encoding::yuyv ? 2 : 1;
  for (std::size_t i = 0; i < kDigits && i * step < out->size(); ++i)
    (*out)[i * step] = static_cast<std::byte>(16 * (number >> (4 * i) & 0xF) + 8);
  return out;
}

}  // namespace lightwell::usb_camera
