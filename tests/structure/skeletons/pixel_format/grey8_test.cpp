// The result of "A pixel format" in CONTRIBUTING.md. An enum cannot be extended from outside, so grey8.patch takes
// steps 1 to 3 in copies of the sources, which come first in the include path of this test. Steps 4 to 6 (the SIMD
// passes, the simulated sensor, the camera backends) are not needed for a format that RowReader reads.
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/response.hpp"
#include "estimate/frames/row_reader.hpp"
#include "imaging/frame.hpp"
#include "pose/grey_view.hpp"

namespace lightwell {
namespace {

constexpr int kWidth = 8, kHeight = 4;
constexpr std::size_t kStride = 10;

std::vector<std::byte> picture() {
  std::vector<std::byte> out(picture_bytes(PixelFormat::grey8, kStride, kHeight));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::byte>(5 * i);
  return out;
}

View view_of(const std::vector<std::byte>& pixels) { return {0, PixelFormat::grey8, kWidth, kHeight, kStride, pixels}; }

// Step 1: the format has a name.
static_assert(pixel_format_of("grey8") == PixelFormat::grey8);

// Step 2: the numbers of its row in kPixelLayouts.
static_assert(packed_stride(PixelFormat::grey8, 8) == 8 && picture_bytes(PixelFormat::grey8, 100, 4) == 400);
static_assert(size_fits(PixelFormat::grey8, 7, 3) && !is_bayer(PixelFormat::grey8));
static_assert(pixel_layout(PixelFormat::grey8).full_scale() == 255);

// Step 3: RowReader::load().
TEST(Grey8, RowReaderReadsTheSameRadianceOfAllChannels) {
  RigParameters rig;
  LensParameters& lens = rig.lenses.emplace_back();
  lens.width = kWidth;
  lens.height = kHeight;
  lens.model = EquirectangularParameters{};
  lens.max_angle_rad = std::numbers::pi;
  lens.pose_cv.rotation = upright_lens_cv();
  lens.photometry.response.kind = ResponseCurve::Kind::srgb;
  const Result<RigTable> table = make_rig_table(rig);
  ASSERT_TRUE(table.ok()) << table.status().message();

  const std::vector<std::byte> pixels = picture();
  Frame frame;
  frame.info.exposure_s = 0.5;
  frame.add_view(view_of(pixels));
  estimate::RowReader reader(rig, *table);
  const Status bound = reader.bind({&frame, 1});
  ASSERT_TRUE(bound.ok()) << bound.message();
  estimate::LinearRow row(kWidth);
  estimate::ReadStatistics counts;
  reader.read(0, 2, 3, kWidth, estimate::RowReader::Reading::radiance, row, counts);
  const std::vector<float> linear = linear_table(lens.photometry, 256);
  for (std::size_t i = 0; i < kWidth - 3; ++i) {
    const float expected = 2 * linear[5 * (2 * kStride + 3 + i)];
    EXPECT_FLOAT_EQ(row.r[i], expected);
    EXPECT_FLOAT_EQ(row.g[i], expected);
    EXPECT_FLOAT_EQ(row.b[i], expected);
  }
}

// Step 3: GreyView::of().
TEST(Grey8, GreyViewIsThePicture) {
  const std::vector<std::byte> pixels = picture();
  GreyView view;
  const GreyPicture grey = view.of(view_of(pixels));
  EXPECT_EQ(grey.width, kWidth);
  EXPECT_EQ(grey.stride, kStride);
  EXPECT_EQ(grey.at(2, 1), 5 * (kStride + 2));
}

}  // namespace
}  // namespace lightwell
