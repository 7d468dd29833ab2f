// Tests of RowReader with and without a table. Its values are tested through the estimators.
#include "estimate/frames/row_reader.hpp"

#include <algorithm>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace lightwell::estimate {
namespace {

constexpr int kWidth = 96, kHeight = 72;

/// The field of view covers the whole picture.
RigParameters rig_with_vignetting() {
  LensParameters lens;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.model = KannalaBrandtParameters{40, 40, 47.5, 35.5, -0.018, 0.0025, -0.0011, 1e-4};
  lens.max_angle_rad = 100 * std::numbers::pi / 180;
  lens.pose_cv.rotation = upright_lens_cv();
  lens.photometry.vignetting = {-0.1, 0.01, 0};
  lens.photometry.read_noise = 0.002;
  lens.photometry.shot_noise = 1e-4;
  return {{lens}, 0};
}

TEST(RowReader, ReadsTheSameWithAndWithoutATable) {
  const RigParameters rig = rig_with_vignetting();
  const Result<RigTable> table = make_rig_table(rig);
  ASSERT_TRUE(table.ok()) << table.status().message();
  std::mt19937 random(1);
  std::vector<std::byte> short_exposure(std::size_t{3} * kWidth * kHeight), long_exposure(short_exposure.size());
  for (std::byte& b : short_exposure) b = static_cast<std::byte>(random() & 127U);
  for (std::size_t i = 0; i < long_exposure.size(); ++i)
    long_exposure[i] = static_cast<std::byte>(std::min(255U, 4 * std::to_integer<unsigned>(short_exposure[i])));
  std::vector<Frame> bracket(2);
  for (std::size_t k = 0; k < 2; ++k) {
    bracket[k].info.exposure_s = k == 0 ? 1 : 4;
    bracket[k].add_view({0, PixelFormat::rgb8, kWidth, kHeight, packed_stride(PixelFormat::rgb8, kWidth),
                         k == 0 ? short_exposure : long_exposure});
  }
  RowReader with(rig, *table), without(rig);
  LinearRow expected(kWidth), row(kWidth);
  ReadStatistics counts;
  for (std::size_t exposures = 1; exposures <= bracket.size(); ++exposures) {
    ASSERT_TRUE(with.bind(std::span(bracket).first(exposures)).ok());
    ASSERT_TRUE(without.bind(std::span(bracket).first(exposures)).ok());
    for (int y = 0; y < kHeight; ++y) {
      const int first = static_cast<int>(random() % kWidth),
                end = first + 1 + static_cast<int>(random() % static_cast<unsigned>(kWidth - first));
      with.read(0, y, first, end, RowReader::Reading::with_errors, expected, counts);
      without.read(0, y, first, end, RowReader::Reading::with_errors, row, counts);
      const auto same = [&](const std::vector<float>& a, const std::vector<float>& b) {
        return std::equal(a.begin(), a.begin() + (end - first), b.begin());
      };
      EXPECT_TRUE(same(row.r, expected.r) && same(row.g, expected.g) && same(row.b, expected.b)) << y;
      EXPECT_TRUE(same(row.variance, expected.variance) && same(row.bias, expected.bias)) << y;
    }
  }
}

}  // namespace
}  // namespace lightwell::estimate
