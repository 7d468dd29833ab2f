// The table of pixel formats against numbers written by hand from the definitions of PixelFormat.
#include "imaging/pixel_layout.hpp"

#include <array>
#include <cstddef>
#include <string>

#include <gtest/gtest.h>

namespace lightwell {
namespace {

struct Expected {
  PixelFormat format;
  std::size_t row_of_8, picture_of_8x4;  ///< Bytes without padding.
  std::size_t padded;                    ///< Bytes of four rows with a stride of 100.
  bool odd_width_fits, odd_height_fits;
  std::size_t alignment;
  int full_scale;  ///< 0 for floats.
  bool mosaic;
};

constexpr std::array kExpected = {
    Expected{PixelFormat::rgb8, 24, 96, 400, true, true, 1, 255, false},
    Expected{PixelFormat::nv12, 8, 48, 600, false, false, 1, 255, false},
    Expected{PixelFormat::yuyv, 16, 64, 400, false, true, 1, 255, false},
    Expected{PixelFormat::bayer_rggb8, 8, 32, 400, false, false, 1, 255, true},
    Expected{PixelFormat::bayer_rggb10, 16, 64, 400, false, false, 2, 1023, true},
    Expected{PixelFormat::bayer_rggb12, 16, 64, 400, false, false, 2, 4095, true},
    Expected{PixelFormat::rgb_f32, 96, 384, 400, true, true, 4, 0, false},
};

class PixelLayoutOf : public testing::TestWithParam<Expected> {};

TEST_P(PixelLayoutOf, BytesOfRowsAndPictures) {
  const Expected& e = GetParam();
  EXPECT_EQ(packed_stride(e.format, 8), e.row_of_8);
  EXPECT_EQ(picture_bytes(e.format, e.row_of_8, 4), e.picture_of_8x4);
  EXPECT_EQ(picture_bytes(e.format, 100, 4), e.padded);
}

TEST_P(PixelLayoutOf, SizesAreWholeUnits) {
  const Expected& e = GetParam();
  EXPECT_TRUE(size_fits(e.format, 8, 4));
  EXPECT_EQ(size_fits(e.format, 7, 4), e.odd_width_fits);
  EXPECT_EQ(size_fits(e.format, 8, 3), e.odd_height_fits);
  for (const int none : {0, -2}) {
    EXPECT_FALSE(size_fits(e.format, none, 4)) << none;
    EXPECT_FALSE(size_fits(e.format, 8, none)) << none;
  }
}

TEST_P(PixelLayoutOf, CodesAndSamples) {
  const Expected& e = GetParam();
  const PixelLayout& layout = pixel_layout(e.format);
  EXPECT_EQ(layout.sample_bytes, e.alignment);
  EXPECT_EQ(layout.full_scale(), e.full_scale);
  EXPECT_EQ(layout.is_float(), e.full_scale == 0);
  EXPECT_EQ(is_bayer(e.format), e.mosaic);
  if (layout.is_float()) {
    EXPECT_EQ(layout.depth_index(), 0U);
  } else {
    EXPECT_EQ(kCodeBits[layout.depth_index()], layout.bits);
  }
}

INSTANTIATE_TEST_SUITE_P(EveryFormat, PixelLayoutOf, testing::ValuesIn(kExpected),
                         [](const auto& p) { return std::string(to_string(p.param.format)); });

TEST(PixelLayout, EveryFormatIsExpectedAbove) { EXPECT_EQ(kExpected.size(), kPixelFormats.size()); }

}  // namespace
}  // namespace lightwell
