// A camera's picture as the grey one that tags are looked for in.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/calibration.hpp>

#include "camera/frame.hpp"
#include "pose/grey_picture.hpp"

namespace lightwell {

/// Holds the grey picture's memory, which is used again for the next one.
class GreyView {
 public:
  /// Luma of NV12 as it is; of the others r + 2 g + b, luma, or what a mosaic's green says around each photosite; of
  /// floats the root of green, as bright as its brightest hundredth. Good until the next call, and as long as the
  /// view's data. A view that does not hold what its size says comes out empty.
  [[nodiscard]] GreyPicture of(const View& view);

 private:
  std::vector<std::uint8_t> bytes_;
  std::vector<float> sample_;
};

/// Linear light of each of the 256 values that GreyView makes of such a picture.
[[nodiscard]] std::vector<float> linear_of_grey(PixelFormat format, const PhotometricCalibration& photometry);

}  // namespace lightwell
