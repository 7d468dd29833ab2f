#include <gtest/gtest.h>

#include "usb_camera/scene_source.hpp"

namespace lightwell::usb_camera {
namespace {

TEST(WhiteBalance, IsNeutralAt6500K) { EXPECT_EQ(white_balance(6500), (std::array<double, 3>{1, 1, 1})) << "exactly"; }

TEST(WhiteBalance, FollowsTheBlackBody) {
  double red = 1e9, blue = 0;
  for (double kelvin = 2800; kelvin <= 8000; kelvin += 10) {
    const auto w = white_balance(kelvin);
    EXPECT_EQ(w[1], 1);
    EXPECT_LT(w[0], red) << kelvin;
    EXPECT_GT(w[2], blue) << kelvin;
    red = w[0];
    blue = w[2];
  }
}

TEST(WhiteBalance, MatchesTabulatedValuesForIlluminantA) {
  // Linear Rec. 709 with Y = 1: CIE illuminant A (x 0.44757, y 0.40745; 2856 K) has red 1.845, green 0.826, blue 0.233;
  // the black body of 6500 K (x 0.3135, y 0.3236) has 1.043, 0.984, 1.035.
  const auto w = white_balance(2856);
  const double green = 0.826 / 0.984;
  EXPECT_NEAR(w[0], 1.845 / 1.043 / green, 0.02);
  EXPECT_NEAR(w[2], 0.233 / 1.035 / green, 0.01);
}

}  // namespace
}  // namespace lightwell::usb_camera
