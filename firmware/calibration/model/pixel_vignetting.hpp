// The relative illumination of a lens at single pixels, for callers that read a small part of a picture.
#pragma once

#include <cstddef>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/camera_model.hpp"

namespace lightwell {

/// LensTable::inverse_vignetting, evaluated for each pixel when it is first read. Not thread-safe.
class PixelVignetting {
 public:
  /// `lens` must pass RigParameters::validate().
  explicit PixelVignetting(const LensParameters& lens);

  /// 1 / relative illumination of pixels [first, end) of row y; beyond the field of view that of its edge. Allocates
  /// nothing; valid as long as this object.
  [[nodiscard]] const float* inverse(int y, int first, int end);

 private:
  [[nodiscard]] float evaluate(int x, int y) const;

  PhotometricCalibration photometry_;
  CameraModel model_;
  std::size_t stride_;          ///< 0 for a lens without vignetting: all rows are the same row of ones.
  std::vector<float> inverse_;  ///< By pixel, rows from the top; 0: not evaluated yet.
};

}  // namespace lightwell
