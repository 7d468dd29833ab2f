#include "pose/grey_picture.hpp"

#include <algorithm>
#include <array>
#include <string>

#include <lightwell/quantile.hpp>

namespace lightwell {

namespace {
constexpr int kMaxSide_px = 16384;
}

Status GreyPicture::validate() const {
  const auto wrong = [](const std::string& what) { return Status(StatusCode::invalid_argument, "picture: " + what); };
  if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px)
    return wrong("it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels; a side must be 1 to " +
                 std::to_string(kMaxSide_px));
  const auto row = static_cast<std::size_t>(width);
  if (stride < row || stride > static_cast<std::size_t>(1) << 20)
    return wrong("stride is " + std::to_string(stride) + " bytes for rows of " + std::to_string(width));
  const std::size_t needed = stride * static_cast<std::size_t>(height - 1) + row;
  if (data.size() < needed)
    return wrong("it has " + std::to_string(data.size()) + " bytes and needs " + std::to_string(needed));
  return {};
}

int contrast_above_noise(const GreyPicture& picture) {
  // AprilTag's contrast test covers 3 x 3 tiles of 4 x 4 pixels.
  constexpr int kWindow = 12, kColumns = 16, kRows = 12;
  constexpr int kMinContrast = 5, kMaxContrast = 15;
  // The share of flat windows in most pictures; where fewer are flat, kMaxContrast limits the result.
  constexpr double kFlat = 0.4;
  if (picture.width < kWindow || picture.height < kWindow) return kMinContrast;
  std::array<int, static_cast<std::size_t>(kColumns) * kRows> ranges;
  std::size_t n = 0;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const int x0 = (picture.width - kWindow) * column / (kColumns - 1);
      const int y0 = (picture.height - kWindow) * row / (kRows - 1);
      int least = 255, most = 0;
      for (int y = y0; y < y0 + kWindow; ++y)
        for (int x = x0; x < x0 + kWindow; ++x) {
          const int v = picture.at(x, y);
          least = std::min(least, v);
          most = std::max(most, v);
        }
      ranges[n++] = most - least;
    }
  const auto flat = static_cast<int>(upper_quantile(ranges, kFlat));
  // A margin for windows with more noise than the typical one.
  return std::clamp(flat + flat / 4 + 1, kMinContrast, kMaxContrast);
}

}  // namespace lightwell
