// The small picture of a frame that a preview shows.
#pragma once

#include <array>
#include <vector>

#include <lightwell/calibration.hpp>

#include "imaging/frame.hpp"
#include "imaging/image_file.hpp"

namespace lightwell {

/// Largest size of the small picture, all lenses together.
inline constexpr int kSmallPictureWidth = 320, kSmallPictureHeight = 160;

/// Linear r, g, b, rows from the top.
struct SmallPicture {
  std::vector<float> rgb;
  /// The brightest value that is not white: 1 for codes, whose full scale is at 1. Of float formats, which have no full
  /// scale, 0: encode_srgb() then finds one.
  float white = 1;
};

/// Reduces frames of one rig. The lenses stand side by side in the order of the calibration, each reduced by one factor
/// that fits them into 320 x 160, never enlarged. Not thread-safe.
class PictureReducer {
 public:
  explicit PictureReducer(const RigParameters& rig);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// A black picture with the memory that reduce() fills.
  [[nodiscard]] SmallPicture blank() const;

  /// Each pixel is the mean of up to 3 x 3 pixels spread evenly over its area (of a mosaic: their 2 x 2 units), linear
  /// (response.hpp) and with the calibration's white balance; vignetting and exposure are those of the frame. Black: a
  /// lens that the frame lacks or whose view does not match the calibration. `out` is from blank(); allocates nothing.
  void reduce(const Frame& frame, SmallPicture& out) const;

 private:
  struct Lens {
    int width = 0, height = 0;  ///< Of its picture.
    int x = 0;                  ///< Column of its left edge in the small picture.
    int small_width = 0, small_height = 0;
    std::vector<int> columns, rows;  ///< Those that are read, in order; equally many for each small pixel.
    std::array<float, 3> white_balance{1, 1, 1};
    std::vector<std::vector<float>> tables;  ///< Linear value by code, by index in kCodeBits.
  };
  void reduce_lens(const View& view, const Lens& lens, SmallPicture& out) const;

  std::vector<Lens> lenses_;
  int width_ = 0, height_ = 0;
};

/// The sRGB picture, rgb8, clipped at `picture.white`; of floats at the 99 % quantile of the largest channel that is
/// above zero.
[[nodiscard]] Image encode_srgb(const SmallPicture& picture, int width, int height);

}  // namespace lightwell
