#include "camera/backends/depthai/oak_picture.hpp"

#include <string>

namespace lightwell::oak {

std::optional<ProbeTime> mid_exposure(const OakPicture& picture, Duration row_readout, ProbeTime now) {
  constexpr Duration kMaxAge = Duration::from_seconds(5);
  const ProbeTime stamp{picture.timestamp_ns};
  if (stamp > now || now - stamp > kMaxAge) return std::nullopt;
  const Duration half_exposure{std::int64_t{500} * picture.exposure_us};
  return stamp - half_exposure + Duration{row_readout.ns * picture.height / 2};
}

Status unpack_raw10(const OakPicture& picture, std::span<std::uint16_t> words) {
  const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
  if (width == 0 || height == 0 || width % 4 != 0 || picture.stride < width / 4 * 5)
    return {StatusCode::data_loss, "raw rows of " + std::to_string(picture.stride) + " bytes do not hold " +
                                       std::to_string(width) + " pixels of 10 bits"};
  if (picture.data.size() < picture.stride * (height - 1) + width / 4 * 5 || words.size() < width * height)
    return {StatusCode::data_loss, "the raw picture is cut off"};
  std::uint16_t* out = words.data();
  for (std::size_t row = 0; row < height; ++row) {
    const std::byte* in = picture.data.data() + row * picture.stride;
    for (std::size_t group = 0; group < width / 4; ++group, in += 5) {
      const auto low = std::to_integer<unsigned>(in[4]);
      for (unsigned k = 0; k < 4; ++k)
        *out++ = static_cast<std::uint16_t>(std::to_integer<unsigned>(in[k]) << 2 | ((low >> (2 * k)) & 3U));
    }
  }
  return {};
}

}  // namespace lightwell::oak
